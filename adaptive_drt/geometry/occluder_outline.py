# SPDX-License-Identifier: GPL-3.0-or-later
"""Outlines of occluders: in which closed form an occluder hides part of a light from a point."""

from __future__ import annotations

__all__ = ["CIRCLE", "CUT", "ELLIPSE", "HIDDEN_PART_KINDS", "NOTHING", "POLYGON", "RAYS"]


NOTHING, CIRCLE, POLYGON, CUT, RAYS, ELLIPSE = range(6)
"""How an occluder hides a light from a point.

In this order: it hides nothing, because it is behind the light; by an outline that is a circle on
the sphere of directions; by a polygonal outline, of which the part in front of the light's plane
counts; by the polygon that it, cut by the light's plane, hides of that plane; in a way for which no
closed form is known, so that rays are distributed; by an outline that is a cone over an ellipse.
"""
HIDDEN_PART_KINDS = (CIRCLE, ELLIPSE, POLYGON, CUT)
"""The kinds of outlines for which the hidden part of a light is known in closed form."""
