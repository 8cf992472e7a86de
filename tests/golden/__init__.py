# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden pictures: small scenes that reach 96 % of the core's lines, and what they looked like."""
