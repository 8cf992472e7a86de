# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at surface points, and estimates of how it varies around them."""
