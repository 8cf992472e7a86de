# SPDX-License-Identifier: GPL-3.0-or-later
"""Light sources and the irradiance that they cause in closed form."""
