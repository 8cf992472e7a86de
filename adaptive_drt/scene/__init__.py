# SPDX-License-Identifier: GPL-3.0-or-later
"""Input and output records of a render: scene, settings and film; units; recognition of meshes."""
