# SPDX-License-Identifier: GPL-3.0-or-later
"""A brute-force renderer that shares no code with the one under test.

It reads the records of `adaptive_drt.scene.description` and nothing else. Every formula is written
in another way than the core's: rows of (n, 3), segments instead of rays, affine frames instead of
plane equations, samples instead of polynomials. It is slow and sure: each answer carries whether it
is clear by a margin, and only clear answers count as evidence.
"""
