# SPDX-License-Identifier: GPL-3.0-or-later
"""Proofs that nothing changes over a light, the shutter or a pixel: the mask."""
