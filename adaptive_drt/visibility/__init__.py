# SPDX-License-Identifier: GPL-3.0-or-later
"""Visibility along lines through boxes in pixel and shutter time, between exactly computed
events."""
