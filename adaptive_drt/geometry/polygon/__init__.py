# SPDX-License-Identifier: GPL-3.0-or-later
"""Convex polygons: the shape, and what tracing, detection and shading ask of it."""
