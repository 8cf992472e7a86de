# SPDX-License-Identifier: GPL-3.0-or-later
"""Detection: proofs that visibility does not change over a light, the shutter or a pixel.

Pixels without such a proof are flagged in the mask, and have rays distributed in that domain.
"""
