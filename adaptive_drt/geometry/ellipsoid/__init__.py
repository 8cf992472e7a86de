# SPDX-License-Identifier: GPL-3.0-or-later
"""Ellipsoids as a kind of shape."""
