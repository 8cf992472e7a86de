# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sources, and the irradiance from them in closed form, open and partly occluded."""
