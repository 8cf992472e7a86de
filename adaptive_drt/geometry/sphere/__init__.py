# SPDX-License-Identifier: GPL-3.0-or-later
"""Spheres: the shape, and what tracing, detection and shading ask of it."""
