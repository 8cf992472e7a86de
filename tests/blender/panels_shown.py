# SPDX-License-Identifier: GPL-3.0-or-later
"""Which of Blender's panels are shown under this engine, and what is wrong about that.

Run by Blender, it prints the faults: blender -b -P panels_shown.py
"""

import sys

import bpy

SHOWN = {
    "render": "color_management color_management_curves simplify simplify_render simplify_viewport "
    "freestyle",
    "output": "format frame_range time_stretching post_processing output encoding stamp",
    "view_layer": "layer freestyle",
    "world": "context_world custom_props EEVEE_surface",
    "material": "EEVEE_context_material EEVEE_surface custom_props",
    "data": "context_camera lens camera camera_display context_light EEVEE_light "
    "context_mesh uv_texture vertex_groups",
    "object": "visibility",
}
"""Of Blender's own, by tab; they are in every version from 4.2 to 5.2. Freestyle's lines are laid
over the picture by Blender itself, whatever the engine; one has to be able to switch them off."""

UNFIT = (
    "stereoscopy", "output_views", "grease", "gpencil", "lightprobe", "volume",
    "_spot", "mist", "displacement", "dof", "depth_of_field", "motion_blur", "sampling",
    "light_paths", "raytracing", "shadow", "bake", "hair", "opengl", "filter", "cryptomatte",
    "aov", "lightgroup", "caustics", "denoise", "beam", "thickness", "settings_surface",
    "preview",
)  # fmt: skip
"""Of names of panels: settings that this engine does not heed, or shows in panels of its own."""


def _tabs():
    """Names of the shown panels that Blender brings, by tab."""
    found = {}
    for panel in bpy.types.Panel.__subclasses__():
        if "ADAPTIVE_DRT" in getattr(panel, "COMPAT_ENGINES", ()):
            if getattr(panel, "bl_space_type", "") == "PROPERTIES":
                found.setdefault(getattr(panel, "bl_context", ""), set()).add(panel.__name__)
    return found


def faults():
    """What is not as it should be, in words."""
    tabs = _tabs()
    found = []
    for tab, names in SHOWN.items():
        shown = tabs.get(tab, set())
        found += [f"{name} is not shown" for name in _full(tab, names.split()) if name not in shown]
        # what shows nothing but that a datablock is there, and its name, may be shown
        harmless = ("_context_", "custom_props", "_freestyle_")
        plain = (n for n in shown if not any(word in n for word in harmless))
        found += [f"{n} is shown" for n in plain if any(word in n for word in UNFIT)]
        found += _doubles(shown)
    return found


def _full(tab, names):
    prefix = {"output": "RENDER", "view_layer": "VIEWLAYER"}.get(tab, tab.upper())
    for name in names:
        if name.startswith("EEVEE_") and tab != "data":
            yield f"EEVEE_{prefix}_PT_{name.removeprefix('EEVEE_')}"
        else:
            yield f"{prefix}_PT_{name}"


def _doubles(names):
    """Panels of one file with the same heading: as the light's once were.

    The node editor's copy shares the set of engines with the panel that it is a copy of.
    """
    heads = {}
    for name in names:
        panel = getattr(bpy.types, name)
        if panel.bl_label and "HIDE_HEADER" not in getattr(panel, "bl_options", ()):
            key = (panel.__module__, panel.bl_label, getattr(panel, "bl_parent_id", ""))
            heads.setdefault(key, []).append(name)
    return [f"{names} say the same" for names in heads.values() if len(names) > 1]


if __name__ == "__main__":
    sys.stdout.write(f"{sum(map(len, _tabs().values()))} panels, faults: {faults()}\n")
