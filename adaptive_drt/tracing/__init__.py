# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled scene: nearest hits, shadow rays and the occluders that matter."""
