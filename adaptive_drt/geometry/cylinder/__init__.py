# SPDX-License-Identifier: GPL-3.0-or-later
"""Cylinders: the shape of their curved sides, and what tracing, detection and shading ask of it."""
