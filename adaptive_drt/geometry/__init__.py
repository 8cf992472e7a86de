# SPDX-License-Identifier: GPL-3.0-or-later
"""Shapes, the camera, and curves on the unit sphere of directions."""
