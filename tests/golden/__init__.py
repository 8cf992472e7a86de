# SPDX-License-Identifier: GPL-3.0-or-later
"""Golden pictures: small scenes that reach every part of the core, and what they looked like."""
