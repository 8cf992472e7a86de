# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive numerical integration over pixel and shutter, to an error goal for each pixel."""
