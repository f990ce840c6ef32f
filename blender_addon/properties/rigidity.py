# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Rigidity."""

import bpy

from ..native import RADIUS_MAX
from .exemplars import OVERRIDABLE, tag_owner

SOURCES = (
    ("UNIFORM", "Uniform", "The whole mesh is of one stiffness"),
    (
        "PAINTED",
        "Painted",
        "A vertex group says how stiff each part is: painted, filled or learned",
    ),
)


def is_mesh(_settings, obj):
    return obj.type == "MESH"


class RigidityProperties(bpy.types.PropertyGroup):
    source: bpy.props.EnumProperty(
        name="Stiffness",
        description="Where the stiffness of the mesh comes from. Taken up at once",
        items=SOURCES,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    radius: bpy.props.IntProperty(
        name="Rings",
        description=(
            "How stiff the mesh is: what lies within so many edges of a vertex turns with it as "
            "one piece. 1: like soft rubber; 6: like a hard material; 15: like metal"
        ),
        default=2,
        min=1,
        max=RADIUS_MAX,
        soft_max=20,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    radius_min: bpy.props.IntProperty(
        name="Softest",
        description="The rings of a vertex that is painted 0, blue. 1: like soft rubber",
        default=1,
        min=1,
        max=RADIUS_MAX,
        soft_max=20,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    radius_max: bpy.props.IntProperty(
        name="Stiffest",
        description="The rings of a vertex that is painted 1, red. More: stiffer, and slower",
        default=6,
        min=1,
        max=RADIUS_MAX,
        soft_max=20,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    group: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    # Tells a renamed vertex group from one that was removed.
    group_index: bpy.props.IntProperty(default=-1, options={"HIDDEN"}, override=OVERRIDABLE)
    fill_value: bpy.props.FloatProperty(
        name="Fill With",
        description="The stiffness that Fill gives to what is selected. 0: softest, 1: stiffest",
        default=1.0,
        min=0.0,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        override=OVERRIDABLE,
    )
    show_radii: bpy.props.BoolProperty(
        name="Show Stiffness",
        description=(
            "Colour the mesh by its stiffness, from soft (blue) to stiff (red), in Object Mode"
        ),
        default=False,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )

    omega: bpy.props.FloatProperty(
        name="Stiff by Default",
        description=(
            "What learning makes of small deformations. Small: the least bend in any pose counts "
            "as soft; large: only strong bends do, and all else becomes stiff"
        ),
        default=0.3,
        min=0.0,
        soft_max=2.0,
        options=set(),
        override=OVERRIDABLE,
    )
    animated: bpy.props.PointerProperty(
        name="Object",
        description=(
            "The animated object to learn from, of the same vertices and faces: by armature, cache "
            "or simulation. Empty: this mesh itself"
        ),
        type=bpy.types.Object,
        poll=is_mesh,
        override=OVERRIDABLE,
    )
    use_scene_range: bpy.props.BoolProperty(
        name="Scene Range",
        description="Learn from the scene's first frame to its last",
        default=True,
        options=set(),
        override=OVERRIDABLE,
    )
    frame_start: bpy.props.IntProperty(
        name="Start",
        description="The first frame to learn from",
        default=1,
        options=set(),
        override=OVERRIDABLE,
    )
    frame_end: bpy.props.IntProperty(
        name="End",
        description="The last frame to learn from",
        default=250,
        options=set(),
        override=OVERRIDABLE,
    )
    frame_step: bpy.props.IntProperty(
        name="Step",
        description="Look at every so many frames",
        default=1,
        min=1,
        soft_max=10,
        options=set(),
        override=OVERRIDABLE,
    )

    handle_size: bpy.props.FloatProperty(
        name="Handle Size",
        description=(
            "A handle smaller than this share of the mesh's size moves a rounded disc of that "
            "size with it, so that a single vertex draws no spike. 0: spikes. "
            "Takes effect at the next Bind"
        ),
        default=0.03,
        min=0.0,
        max=1.0,
        soft_max=0.1,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description=(
            "Refine until a round takes less than this share off the energy. "
            "Smaller: nearer to the end, and slower. 0: just as many rounds as Iterations says"
        ),
        default=1e-3,
        min=0.0,
        soft_max=0.01,
        precision=6,
        step=0.001,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    iterations: bpy.props.IntProperty(
        name="Iterations",
        description="Rounds of refinement a solve, at most. 0: chosen for you",
        default=0,
        min=0,
        soft_max=1000,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    acceleration: bpy.props.BoolProperty(
        name="Acceleration",
        description="Look ahead from one round to the next, which needs fewer of them",
        default=True,
        override=OVERRIDABLE,
        update=tag_owner,
    )


classes = (RigidityProperties,)
register, unregister = bpy.utils.register_classes_factory(classes)
