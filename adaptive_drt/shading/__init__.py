# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at points, and how it varies around them."""
