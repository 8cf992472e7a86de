# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a scene: `scene.adaptive_drt`."""

import bpy
from bpy.props import BoolProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty

from ..adaptive_drt.scene.settings import Settings

DEFAULTS = Settings()

METHODS = (
    (
        "EXACT",
        "Exact",
        "Light in closed form; the shutter and the pixel between exact events, to a tolerance",
        1,
    ),
    (
        "RAYS",
        "Distributed Rays",
        "Distribute a given number of rays where the derivatives of one ray ask for it",
        0,
    ),
)
ORDERS = (
    ("1", "First", "Gradients alone: cheaper to carry, flags more pixels", 1),
    ("2", "Second", "Gradients and Hessians: flags no pixel that could have been spared", 2),
)
DISTRIBUTIONS = (
    ("ADAPTIVE", "Adaptive", "Distribute rays only where the result could change", 0),
    ("EVERYWHERE", "Everywhere", "Distribute rays in every pixel, for comparison", 1),
)
SPHERES = (
    (
        "AUTO",
        "Automatic",
        "Render a mesh in the form of a sphere as a sphere, unless it is flat-shaded and has fewer "
        "than 400 faces, or has custom normals or several materials",
        0,
    ),
    (
        "SPHERES",
        "Always",
        "Render every mesh in the form of a sphere as a sphere: without noise",
        1,
    ),
    ("FACES", "Never", "Render the faces of every mesh, as Cycles does", 2),
)


class ADRT_PG_settings(bpy.types.PropertyGroup):
    """How Adaptive Render renders a scene."""

    method: EnumProperty(
        name="Method",
        description="How flagged pixels are resolved",
        items=METHODS,
        default=DEFAULTS.method,
    )
    tolerance: FloatProperty(
        name="Tolerance",
        description="Error that the picture may have: root mean square, relative to the picture's "
        "mean; 0.001 is 0.1 %. For the method Exact",
        default=DEFAULTS.tolerance,
        min=1e-7,
        soft_min=1e-4,
        soft_max=0.1,
        max=1.0,
        step=0.1,
        precision=6,  # with fewer, what a script may set is shown as 0
    )
    order: EnumProperty(
        name="Order",
        description="Order of the derivatives that decide where rays are distributed",
        items=ORDERS,
        default=str(DEFAULTS.order),
    )
    distribution: EnumProperty(
        name="Distribution",
        description="Which pixels get distributed rays",
        items=DISTRIBUTIONS,
        default=DEFAULTS.distribution,
    )
    light_rays: IntProperty(
        name="Light Rays",
        description="Rays to each light in a pixel that lies in a penumbra",
        default=DEFAULTS.light_rays,
        min=1,
        soft_max=1024,
        max=1 << 20,
    )
    time_rays: IntProperty(
        name="Time Rays",
        description="Rays over the shutter in a pixel that sees motion",
        default=DEFAULTS.time_rays,
        min=1,
        soft_max=1024,
        max=1 << 20,
    )
    pixel_rays: IntProperty(
        name="Pixel Rays",
        description="Rays over the area of a pixel that holds an edge",
        default=DEFAULTS.pixel_rays,
        min=1,
        soft_max=256,
        max=1 << 20,
    )
    use_penumbra: BoolProperty(
        name="Penumbrae",
        description="Soft shadows of lights that have a size; otherwise shadows fall "
        "from each light's centre",
        default=True,
    )
    # one switch alone: Blender's own, under the name that scripts and the command know
    use_motion: BoolProperty(
        name="Motion Blur",
        description="Blur what moves while the shutter is open: the scene's own Motion Blur",
        get=lambda self: bool(self.id_data.render.use_motion_blur),
        set=lambda self, value: setattr(self.id_data.render, "use_motion_blur", value),
    )
    use_edges: BoolProperty(
        name="Edges",
        description="Anti-aliasing; otherwise a pixel is what its centre sees",
        default=True,
    )
    spheres: EnumProperty(
        name="Spheres",
        description="Which meshes in the form of a sphere are rendered as spheres. With Never, "
        "those in the form of a cylinder are not rendered as cylinders either",
        items=SPHERES,
        default="AUTO",
    )
    seed: IntProperty(
        name="Seed",
        description="Choice of the low-discrepancy points; the same seed gives the same picture",
        default=0,
    )
    threads: IntProperty(
        name="Threads",
        description="Processor threads to use, 0 for all. Larger pictures are shared by processes",
        default=0,
        min=0,
        max=1024,
    )


def register() -> None:
    bpy.utils.register_class(ADRT_PG_settings)
    bpy.types.Scene.adaptive_drt = PointerProperty(type=ADRT_PG_settings)


def unregister() -> None:
    del bpy.types.Scene.adaptive_drt
    bpy.utils.unregister_class(ADRT_PG_settings)
