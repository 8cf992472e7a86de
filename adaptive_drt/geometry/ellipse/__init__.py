# SPDX-License-Identifier: GPL-3.0-or-later
"""Flat ellipses, disks among them, as a kind of shape."""
