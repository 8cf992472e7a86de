# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as a render of this engine gets it, without the render.

Blender builds what a render sees (modifiers, particles and visibility for rendering) for render
engines alone. So the button lets Blender render with this engine, which exports the scene and
leaves it at that. What an operator has at hand is the viewport's scene, which may be another.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from typing import Any

import bpy

from ..adaptive_drt.scene.description import Issue, Scene, SceneError
from ..adaptive_drt.scene.settings import Settings
from .export import export_scene, kept_frame
from .export.compositing import compositing_issues
from .export.nodes import called
from .settings import settings_of
from .temporary import changed, kept_edits, kept_render_result

ENGINE = "ADAPTIVE_DRT"


@dataclass
class Request:
    """Asks the engine to export only.

    found : the exported scene and its settings, once it has.
    error : what has kept it from that.
    """

    found: tuple[Scene, Settings] | None = None
    error: Exception | None = None

    def answer(self, engine: Any, depsgraph: Any) -> None:
        """Export, called by the engine in place of a render."""
        try:
            # Blender draws Grease Pencil over the Render Result, which the button does not make
            self.found = export(engine, depsgraph, draws_strokes=False)
        # the engine must raise nothing: whoever asked does
        except Exception as error:
            self.error = error


pending: list[Request] = []
"""The request that the engine's next call is for, if any."""


def export(engine: Any, depsgraph: Any, draws_strokes: bool = True) -> tuple[Scene, Settings]:
    """Return the scene and settings of a render that Blender has begun.

    Parameters
    ----------
    draws_strokes : whether Blender draws Grease Pencil over the picture afterwards.

    Raises
    ------
    SceneError, SettingsError
        The scene cannot be rendered at all.
    """
    scene = depsgraph.scene.original
    settings = settings_of(scene)
    with kept_frame(scene, engine) as move:
        spheres = scene.adaptive_drt.spheres
        found = export_scene(depsgraph, move, settings.use_motion, draws_strokes, spheres)
        return found, settings


def export_for_render(scene: Any, view_layer: Any) -> tuple[Scene, Settings]:
    """Return a Blender scene's view layer as F12 with this engine would render it.

    Nothing that the user sees changes: the engine, the frame, edits that are not keyed and the
    render slots are as before.

    Raises
    ------
    SceneError, SettingsError
        The scene cannot be rendered at all.
    """
    if scene.camera is None:
        raise SceneError("The scene has no camera: add one, or make one active")
    request = Request()
    pending.append(request)
    has_lines = scene.render.use_freestyle and view_layer.use_freestyle
    try:
        with _export_only(scene, view_layer):
            bpy.ops.render.render(scene=scene.name)
    except RuntimeError as error:
        if request.error is None and request.found is None:
            raise SceneError(str(error).strip().removeprefix("Error: ")) from error
    finally:
        pending.clear()
    if request.error is not None:
        raise request.error
    if request.found is None:
        raise SceneError("Blender did not render the scene: is another render running?")
    exported, settings = request.found
    # no compositor ran now, but the scene's may ask for passes of the next render
    more = [*compositing_issues(scene, view_layer)]
    if has_lines:
        more.append(_lines_issue(view_layer))
    return replace(exported, issues=(*exported.issues, *more)), settings


def _lines_issue(view_layer: Any) -> Issue:
    return Issue(
        called("View Layer", view_layer.name),
        "its Freestyle lines are left out here; Render Image (F12) draws them",
        kind="VIEW_LAYER",
        target=view_layer.name,
    )


@contextmanager
def _export_only(scene: Any, view_layer: Any) -> Iterator[None]:
    """Let a render be one of this engine and this view layer, and be over when the engine is."""
    with ExitStack() as stack:
        for layer in scene.view_layers:
            stack.enter_context(changed(layer, use=layer == view_layer))
        stack.enter_context(kept_edits())
        # a marker of the timeline may make another camera the active one, as for F12
        stack.enter_context(changed(scene, camera=scene.camera))
        stack.enter_context(
            changed(
                scene.render,
                engine=ENGINE,
                use_compositing=False,
                use_sequencer=False,
                use_freestyle=False,
            )
        )
        stack.enter_context(kept_render_result())
        yield
