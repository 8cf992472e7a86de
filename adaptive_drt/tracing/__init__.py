# SPDX-License-Identifier: GPL-3.0-or-later
"""The compiled scene, nearest hits of camera rays, shadow rays and culling of occluders."""
