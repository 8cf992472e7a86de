# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a render: one frozen, validated record of numbers and switches."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Settings", "SettingsError"]

METHODS = ("EXACT", "RAYS")
DISTRIBUTIONS = ("ADAPTIVE", "EVERYWHERE")
ACCELERATORS = ("AUTO", "ARRAYS", "EMBREE")


class SettingsError(ValueError):
    """A setting is out of range; the message names it and says what is allowed."""


@dataclass(frozen=True)
class Settings:
    """Method, ray counts and switches of one render.

    Attributes
    ----------
    method : 'EXACT', light in closed form, pixels and shutter integrated to a tolerance; or 'RAYS',
        the paper's method: n rays distributed where the derivatives ask for them.
    tolerance : EXACT only: RMS error of the picture relative to its mean, > 0.
    order : 1 or 2, the order of the derivatives that detection uses.
    distribution : 'ADAPTIVE', or 'EVERYWHERE' (the paper's baseline: every pixel distributed).
    light_rays, time_rays, pixel_rays : rays distributed over light, shutter and pixel (>= 1).
    use_penumbra, use_motion, use_edges : which effects are rendered at all. Without penumbrae a
        light casts shadows as a point at its centre; without motion the scene is static at the
        middle of the shutter; without edges only the pixel's centre is evaluated.
    seed : selects the low-discrepancy points, any integer.
    threads : worker threads, 0 = one per core.
    reuse : keep what detection has proven (static hits, occluders that cannot matter) when
        rays are distributed. False makes a distributed pixel do all the work that EVERYWHERE
        does, which equation 10 of the paper assumes. The picture is the same.
    accelerator : method of finding candidate occluders; 'AUTO' lets `compile` decide.
    batch : pixels per batch; the picture does not depend on it.
    """

    method: str = "EXACT"
    tolerance: float = 1e-3
    order: int = 2
    distribution: str = "ADAPTIVE"
    light_rays: int = 49
    time_rays: int = 128
    pixel_rays: int = 16
    use_penumbra: bool = True
    use_motion: bool = True
    use_edges: bool = True
    seed: int = 0
    threads: int = 0
    reuse: bool = True
    accelerator: str = "AUTO"
    batch: int = 65_536

    def __post_init__(self) -> None:
        """Raise `SettingsError` for anything out of range."""
        for name, value, allowed in (
            ("method", self.method, METHODS),
            ("order", self.order, (1, 2)),
            ("distribution", self.distribution, DISTRIBUTIONS),
            ("accelerator", self.accelerator, ACCELERATORS),
        ):
            if value not in allowed:
                raise SettingsError(f"{name} is {value!r}; it must be one of {allowed}")
        if not (isinstance(self.tolerance, float | int) and 0.0 < self.tolerance < float("inf")):
            raise SettingsError(f"tolerance is {self.tolerance!r}; it must be a number > 0")
        for name, count, least in (
            ("light_rays", self.light_rays, 1),
            ("time_rays", self.time_rays, 1),
            ("pixel_rays", self.pixel_rays, 1),
            ("batch", self.batch, 1),
            ("threads", self.threads, 0),
        ):
            if not isinstance(count, int) or count < least:
                raise SettingsError(f"{name} is {count!r}; it must be an integer >= {least}")
