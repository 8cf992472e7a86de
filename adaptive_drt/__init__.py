# SPDX-License-Identifier: GPL-3.0-or-later
"""Adaptive DRT's tracer: adaptive distributed ray tracing with automatic differentiation.

It knows numpy and embreex, never Blender.
"""
