# SPDX-License-Identifier: GPL-3.0-or-later
"""Ray Visibility of objects, and the collections that lights are linked to."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

from ...adaptive_drt.scene.description import EVERYWHERE, ShapeRecord, Visibility

NO_NAMES: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Members:
    """The objects of a collection that a light is linked to.

    Attributes
    ----------
    included : names of objects; where there are none, all but the excluded ones belong to it.
    excluded : names of objects.
    """

    included: frozenset[str] = NO_NAMES
    excluded: frozenset[str] = NO_NAMES

    def hold(self, names: frozenset[str]) -> bool:
        """Whether an object belongs to it that goes by several names."""
        return not (names & self.excluded) and (not self.included or bool(names & self.included))


ALL = Members()


@dataclass(frozen=True)
class LightLinks:
    """The objects that a light lights, and those that hide it."""

    receivers: Members = ALL
    blockers: Members = ALL


def links_of(thing: Any) -> LightLinks:
    """Return the links of an evaluated object that gives light."""
    linking = getattr(thing, "light_linking", None)  # 4.0 and later
    if linking is None:
        return LightLinks()
    return LightLinks(
        members_of(linking.receiver_collection), members_of(linking.blocker_collection)
    )


def members_of(collection: Any | None) -> Members:
    """Return the objects of a collection by their states; None stands for all objects."""
    if collection is None:
        return ALL
    states: dict[str, set[str]] = {"INCLUDE": set(), "EXCLUDE": set()}
    pairs = zip(collection.objects, collection.collection_objects, strict=False)
    for thing, entry in pairs:
        states[entry.light_linking.link_state].add(thing.name_full)
    for child, entry in zip(collection.children, collection.collection_children, strict=False):
        names = {thing.name_full for thing in child.all_objects}
        states[entry.light_linking.link_state] |= names
    return Members(frozenset(states["INCLUDE"]), frozenset(states["EXCLUDE"]))


def names_of(thing: Any, instancer: Any | None) -> frozenset[str]:
    """Return the names by which collections hold an instance."""
    things = (thing,) if instancer is None else (thing, instancer)
    return frozenset(each.original.name_full for each in things)


def visibility_of(thing: Any, instancer: Any | None, layer: Any) -> Visibility:
    """Return the Ray Visibility of a shape, and whether it is a holdout.

    Its instancer's visibility takes away from its own, and its instancer's Holdout is in force in
    place of its own. The same holds for those of the collections in a view layer; what is Indirect
    Only there is seen by no camera, unless it is a holdout.
    """

    def met(rays: str) -> bool:
        return bool(getattr(thing, rays) and (instancer is None or getattr(instancer, rays)))

    owner = thing if instancer is None else instancer
    holdout = bool(owner.is_holdout or owner.original.holdout_get(view_layer=layer))
    hidden = not holdout and bool(owner.original.indirect_only_get(view_layer=layer))
    camera, shadow = met("visible_camera") and not hidden, met("visible_shadow")
    if camera and shadow and not holdout:
        return EVERYWHERE
    return Visibility(camera, shadow, holdout=holdout)


def linked(
    shapes: Sequence[tuple[ShapeRecord, frozenset[str]]], links: Iterable[tuple[str, LightLinks]]
) -> Iterator[ShapeRecord]:
    """Yield shapes with what is linked to lights.

    Parameters
    ----------
    shapes : each with the names of its object.
    links : of each light by its name.
    """
    some = [(name, each) for name, each in links if each != LightLinks()]
    for shape, names in shapes:
        unlit = {light for light, each in some if not each.receivers.hold(names)}
        passed = {light for light, each in some if not each.blockers.hold(names)}
        seen = shape.visibility
        if unlit or passed:
            seen = replace(seen, unlit_by=seen.unlit_by | unlit, passed_by=seen.passed_by | passed)
        yield shape if seen is shape.visibility else replace(shape, visibility=seen)
