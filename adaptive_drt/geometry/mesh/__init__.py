# SPDX-License-Identifier: GPL-3.0-or-later
"""Meshes of triangles as a kind of shape."""
