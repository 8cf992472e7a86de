# SPDX-License-Identifier: GPL-3.0-or-later
"""The axes of boxes and the ends of the shutter."""

from adaptive_drt.numerics.axes import SHUTTER_ENDS, TIME


def test_time_is_the_third_axis_and_the_shutter_is_open_for_1():
    assert TIME == 2 and SHUTTER_ENDS[1] - SHUTTER_ENDS[0] == 1.0 and sum(SHUTTER_ENDS) == 0.0
