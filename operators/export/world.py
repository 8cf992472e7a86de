# SPDX-License-Identifier: GPL-3.0-or-later
"""Blender worlds: the colour that is seen, and the light that it throws on surfaces."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from ...adaptive_drt.scene.description import EnvironmentLight, Issue, SkyLight, SunLight, Vector
from ...adaptive_drt.scene.environment_images import (
    EQUIRECTANGULAR,
    MappedImage,
    make_environment_light,
)
from .baked import SKY, Baked, baked, folding
from .environment import TEXTURE, image_of
from .links import Known, Source, Value, output_node, surface_of
from .listing import left_out
from .node_graph import NotDescribedError, graph_of
from .nodes import called, node_called, uses_nodes
from .shader import EMITTERS, MIXERS, Shader, mixed_parts
from .sky import SUN_IS_NOT_SEEN, sky_of
from .world_table import CYCLES_WORLD, LIGHTING, MIST, VISIBILITY, WORLD

BLACK: Vector = (0.0, 0.0, 0.0)
WHITE: Vector = (1.0, 1.0, 1.0)

COARSE = 1e-3
"""Relative error of the light of a tabulated world from which it is told."""

NOT_DIFFUSE = ("Is Shadow Ray", "Is Glossy Ray", "Is Singular Ray", "Is Transmission Ray")
"""Outputs of a Light Path node that are 0 for the camera's rays, and where a world lights surfaces
that scatter light evenly."""


@dataclass(frozen=True)
class Radiance:
    """Radiance of a world: a colour (RGB), images of the sphere, and the suns of skies."""

    color: Vector = BLACK
    images: tuple[MappedImage, ...] = ()
    suns: tuple[SunLight, ...] = ()

    def __bool__(self) -> bool:
        """Whether it is not black."""
        return any(self.color) or bool(self.images or self.suns)

    def times(self, factor: float) -> Radiance:
        """Return it so many times as bright."""
        if factor == 0.0:
            return Radiance()
        images = (replace(image, color=_scaled(image.color, factor)) for image in self.images)
        suns = (sun.brightened(factor) for sun in self.suns)
        return Radiance(_scaled(self.color, factor), tuple(images), tuple(suns))

    def plus(self, other: Radiance) -> Radiance:
        """Return the sum."""
        (a, b, c), (x, y, z) = self.color, other.color
        return Radiance((a + x, b + y, c + z), self.images + other.images, self.suns + other.suns)


@dataclass(frozen=True)
class World:
    """What a world gives: what is seen where nothing is hit, and a light or None.

    background : radiance (RGB).  backdrop : what is seen instead, or None.
    """

    background: Vector = BLACK
    light: SkyLight | EnvironmentLight | None = None
    suns: tuple[SunLight, ...] = ()
    backdrop: EnvironmentLight | None = None


def world_of(world: Any | None, issues: list[Issue]) -> World:
    """Return what a world gives, and append what of it is left out."""
    if world is None:
        return World()
    reasons = _settings(world)
    if uses_nodes(world):
        seen, thrown = _shaded(world, reasons)
    else:
        seen = thrown = Radiance(_rgb(world.color))
    said = called("World", world.name)
    issues.extend(Issue(said, r, kind="WORLD", target=world.name) for r in reasons)
    # a change of an add-on's settings does not reach the evaluated copy
    sight = getattr(world.original, "cycles_visibility", None)
    seen = seen if sight is None or sight.camera else Radiance()
    backdrop = make_environment_light(seen.images, seen.color, said) if seen.images else None
    color = BLACK if backdrop is not None else seen.color
    if not (thrown and (sight is None or sight.diffuse)):
        return World(color, None, (), backdrop)
    shadows = bool(getattr(getattr(world.original, "cycles", None), "use_shadows", True))
    suns = tuple(replace(sun, casts_shadow=shadows) for sun in thrown.suns)
    if not thrown.images:
        light = SkyLight(thrown.color, casts_shadow=shadows, name=said)
        return World(color, light, suns, backdrop)
    around = make_environment_light(thrown.images, thrown.color, said)
    return World(color, replace(around, casts_shadow=shadows), suns, backdrop)


def _settings(world: Any) -> list[str]:
    """Return what is left out of a world's settings, Cycles' own included."""
    tables = (
        (WORLD, world),
        (MIST, world.mist_settings),
        (LIGHTING, world.light_settings),
        (CYCLES_WORLD, getattr(world.original, "cycles", None)),
        (VISIBILITY, getattr(world.original, "cycles_visibility", None)),
    )
    return [reason for table, owner in tables for reason, _ in left_out(table, owner)]


@dataclass(frozen=True)
class _Found:
    """What of a world's nodes is not read as it is.

    Attributes
    ----------
    linked : inputs that are not constant.
    missing : names of nodes that are not understood.
    unread : images that are left out.
    notes : what is left out of what is read.
    """

    linked: list[str] = field(default_factory=list)
    missing: list[str] = field(default_factory=list)
    unread: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def is_whole(self) -> bool:
        """Whether all nodes are read."""
        return not (self.linked or self.missing or self.unread)


def _shaded(world: Any, reasons: list[str]) -> tuple[Radiance, Radiance]:
    """Return what the camera sees of a world's nodes, and the radiance that they throw."""
    output = output_node(world.node_tree)
    if output is not None:
        reasons.extend(Shader(Source(output, None)).terms())
    source = surface_of(world.node_tree)
    found = _Found()
    seen, thrown = (_radiance(source, folding(known), found) for known in RAYS)
    if not found.is_whole:
        try:
            graphs = [graph_of(source, known) for known in RAYS]
            notes: list[str] = []
            seen, thrown = (
                _tabulated(part, f"its {_named(source)}", notes)
                for part in (baked(graphs[0]), baked(graphs[1]).for_light())
            )
            reasons.extend(dict.fromkeys(notes))
            return seen, thrown
        except NotDescribedError as error:
            reasons.append(f"its nodes are not tabulated: {error}")
    if found.missing:
        said = f"its {found.missing[0]} is left out, and the light that it throws"
        reasons.append(f"{said}; black is used")
        return Radiance(), Radiance()
    reasons.extend(dict.fromkeys([*found.unread, *found.notes]))
    if not found.linked:
        return seen, thrown
    used = f"what its {_named(source)} is set to is seen, and lights nothing"
    reasons.extend(
        f"{said}, and the light that it throws; {used}" for said in dict.fromkeys(found.linked)
    )
    return seen, Radiance()


def _named(source: Source) -> str:
    """Return what a person calls the node that feeds a world's surface."""
    return "world" if source.node is None else node_called(source.node)


def _tabulated(found: Baked, said: str, notes: list[str]) -> Radiance:
    """Return the radiance of a world as Blender evaluates it.

    said : what a person calls it.  notes : gets what is left out.
    """
    if found.suns:
        notes.append(f"the sun of {said} {SUN_IS_NOT_SEEN}")
    lowest = float(found.pixels.min())
    pixels, color = np.maximum(found.pixels, np.float32(0.0)), found.color
    if lowest < 0.0:
        notes.append(f"{said} is below 0 in some directions; black is used there")
    if color is not None:
        r, g, b = (max(x, 0.0) for x in color)
        return Radiance((r, g, b), suns=found.suns)
    # the error that matters is relative to the light of the whole sphere
    height = np.sin((np.arange(len(pixels)) + 0.5) * np.pi / len(pixels))
    mean = float((pixels.mean(axis=1).T @ height).max() / height.sum())
    if found.error > COARSE * np.pi * mean:
        share = found.error / (np.pi * mean)
        notes.append(
            f"{said} is finer than the table of {len(pixels)} rows that stands for it: the light "
            f"that it throws is off by some {100.0 * share:.1g} %"
        )
    image = MappedImage(pixels, EQUIRECTANGULAR, np.eye(3, 4), WHITE, found.error)
    return Radiance(images=(image,), suns=found.suns)


def _radiance(source: Source, known: Known, found: _Found) -> Radiance:
    """Return the radiance of a world's shader for one kind of ray.

    known : what the outputs of a Light Path node are for that kind.
    """
    node = source.node
    if node is None:  # Cycles shows black, too
        return Radiance()
    if node.bl_idname in EMITTERS:
        return _emitted(source, known, found)
    if node.bl_idname not in MIXERS:
        found.missing.append(node_called(node))
        return Radiance()
    (a, one), (b, two) = mixed_parts(source, found.linked, known)
    return _radiance(one, known, found).times(a).plus(_radiance(two, known, found).times(b))


def _emitted(source: Source, known: Known, found: _Found) -> Radiance:
    """Return the radiance of a node that shines: its colour, or its image, times its strength."""
    shader = Shader(source, known)
    fed = shader.source("Color")
    kind = None if fed is None or fed.node is None else fed.node.bl_idname
    if fed is None or kind not in (TEXTURE, SKY) or fed.passed:
        return Radiance(shader.emission(found.linked))
    strength = shader.rendered_number("Strength", found.linked)
    if not strength:
        return Radiance()
    color = (strength, strength, strength)
    if kind == TEXTURE:
        image, sun = image_of(fed, color, found.unread), None
    else:
        image, sun = sky_of(fed, color, found.unread, found.notes)
    return Radiance(images=() if image is None else (image,), suns=() if sun is None else (sun,))


def _scaled(color: Vector, factor: float) -> Vector:
    """Return a colour so many times as bright."""
    r, g, b = color
    return (r * factor, g * factor, b * factor)


def _camera_ray(source: Source) -> Value | None:
    """Return what a Light Path node's outputs are for rays from the camera, or None."""
    return _light_path(source, {"Is Camera Ray": 1.0, "Is Diffuse Ray": 0.0})


def _light_ray(source: Source) -> Value | None:
    """Return what a Light Path node's outputs are where a world lights surfaces, or None.

    Cycles looks at a world along rays that surfaces scatter, and as at any other light: only what
    is the same in both is known.
    """
    return _light_path(source, {"Is Camera Ray": 0.0})


RAYS: tuple[Known, Known] = (_camera_ray, _light_ray)
"""What is known of the rays by which a world is seen, and by which it lights surfaces."""


def _light_path(source: Source, kind: dict[str, float]) -> Value | None:
    if source.node is None or source.socket is None or source.node.type != "LIGHT_PATH":
        return None
    own = {**dict.fromkeys(NOT_DIFFUSE, 0.0), **kind}
    found = own.get(source.socket.identifier)
    return None if found is None else (found,)


def _rgb(color: Any) -> Vector:
    r, g, b = color
    return (float(r), float(g), float(b))
