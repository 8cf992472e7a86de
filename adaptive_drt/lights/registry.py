# SPDX-License-Identifier: GPL-3.0-or-later
"""The kinds of lights that the tracer knows, by the records that describe them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import Any, TypeAlias

from ..scene.description import (
    DiskLight,
    EllipseLight,
    EnvironmentLight,
    Light,
    PointLight,
    PolygonLight,
    QuadLight,
    SkyLight,
    SphereLight,
    SpotLight,
    SunLight,
)
from .bright_spots import split_bright_spots
from .disk_light import make_disk_emitter
from .emitter import Emitter, LightMotion
from .environment_light import make_environment_emitter
from .point_light import make_point_emitter
from .polygon_light import make_polygon_emitter
from .sky_light import make_sky_emitter
from .sphere_light import make_sphere_emitter
from .spot_light import make_spot_emitter
from .spread_light import make_spread_ellipse_emitter, make_spread_quad_emitter
from .sun_light import make_sun_emitter

__all__ = ["LIGHTS", "make_emitter", "split_lights"]

_Maker: TypeAlias = Callable[[Any, LightMotion], Emitter]

LIGHTS: tuple[tuple[type[Light], _Maker], ...] = (
    (QuadLight, make_spread_quad_emitter),
    (EllipseLight, make_spread_ellipse_emitter),
    (PolygonLight, make_polygon_emitter),
    (SphereLight, make_sphere_emitter),
    (DiskLight, make_disk_emitter),
    (PointLight, make_point_emitter),
    (SpotLight, make_spot_emitter),
    (SunLight, make_sun_emitter),
    (SkyLight, make_sky_emitter),
    (EnvironmentLight, make_environment_emitter),
)
"""Records of lights, and the functions that make emitters of them: the one list of all kinds."""


def make_emitter(light: Light, motion: LightMotion) -> Emitter:
    """Return a validated light as an emitter.

    Raises
    ------
    TypeError
        The light's record is not in `LIGHTS`.
    """
    for record, make in LIGHTS:
        if type(light) is record:
            return make(light, motion)
    raise TypeError(f"{type(light).__name__} is no kind of light that the tracer knows")


def split_lights(lights: Iterable[Light]) -> Iterator[Light]:
    """Yield lights, with the bright spots of environments as lights of their own."""
    for light in lights:
        if isinstance(light, EnvironmentLight):
            rest, spots = split_bright_spots(light)
            yield rest
            yield from spots
        else:
            yield light
