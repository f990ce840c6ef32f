# SPDX-License-Identifier: GPL-3.0-or-later
# flake8: noqa: F722, F821 (Blender's properties are calls where annotations should be)
"""Sequences: how an object is captured (`Object.exemplar_capture`), and what an object that shows a
sequence knows (`Object.exemplar_sequence`)."""

import bpy

from ..native import ShapeSpace

OVERRIDABLE = {"LIBRARY_OVERRIDABLE"}

# Of what the library offers, in words.
SPACES = {
    "POSITIONS": ("Positions", "Vertex coordinates. Fast; turns of more than a right angle shrink"),
    "GRADIENTS": ("Deformation Gradients", "Turns of parts stay turns, also far between poses"),
    "LINEAR_ROTATION_INVARIANT": (
        "Rotation Invariant",
        "Local frames and what they see: bends without shrinking",
    ),
    "LENGTHS_ANGLES": (
        "Lengths and Angles",
        "Edge lengths and the angles between faces. Slow, and the most faithful for large turns",
    ),
    "PATCHES": (
        "Patches",
        "Rotations of patches against each other: faithful and quicker than lengths and angles",
    ),
}
FIDELITIES = (
    ("TOLERANCE", "Tolerance", "As few numbers as keep the frames within a distance"),
    ("EXACT", "Exact", "Every frame is given back as it was captured"),
    ("COUNTS", "Counts", "Give the number of control points, poses and shapes"),
)
FOLLOW = (
    ("TIME", "Time", "The shape is that of Time, which has a curve in the Graph Editor"),
    ("PLAYHEAD", "Playhead", "The shape is that of the playhead's place in the pose space"),
)


def _space_items():
    items = []
    for space in ShapeSpace:
        label, words = SPACES.get(space.name, (space.name.replace("_", " ").title(), ""))
        items.append((space.name, label, words, int(space)))
    return items


def tag_owner(self, _context):
    """In background mode a property that Python sets wakes no handler by itself."""
    self.id_data.update_tag()


class FitOptions:
    """Annotations for a PropertyGroup and an operator to share."""

    shape_space: bpy.props.EnumProperty(
        name="Shapes",
        description="How shapes are mixed between poses",
        items=_space_items(),
        default=0,
    )
    fidelity: bpy.props.EnumProperty(
        name="Fidelity",
        description="How near the frames the sequence has to come",
        items=FIDELITIES,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description="How far vertices may be off on average, in percent of the mesh's size",
        default=0.1,
        min=1e-4,
        soft_max=2.0,
        max=50.0,
        precision=3,
        subtype="PERCENTAGE",
    )
    control_points: bpy.props.IntProperty(
        name="Control Points", description="Of the curve through the pose space", default=16, min=4
    )
    poses: bpy.props.IntProperty(
        name="Poses",
        description="How many frames shape the pose space; the others lie between them",
        default=12,
        min=3,
    )
    shapes: bpy.props.IntProperty(
        name="Shapes", description="How many shapes are mixed to give a pose", default=7, min=1
    )
    cyclic: bpy.props.BoolProperty(
        name="Cyclic",
        description="The last frame is followed by the first, and the animation goes on for ever",
        default=False,
    )


class CaptureOptions(FitOptions):
    use_scene_range: bpy.props.BoolProperty(
        name="Scene Range",
        description="Capture from the scene's first frame to its last",
        default=True,
    )
    frame_start: bpy.props.IntProperty(
        name="Start", description="The first captured frame", default=1
    )
    frame_end: bpy.props.IntProperty(name="End", description="The last captured frame", default=250)
    frame_step: bpy.props.IntProperty(
        name="Step",
        description="Capture every so many frames; those between are the sequence's own",
        default=1,
        min=1,
        soft_max=10,
    )
    use_world_space: bpy.props.BoolProperty(
        name="World Space",
        description="Capture where the object goes, too, and not only how its mesh changes",
        default=False,
    )


class CaptureProperties(CaptureOptions, bpy.types.PropertyGroup):
    pass


class SequenceProperties(bpy.types.PropertyGroup):
    is_sequence: bpy.props.BoolProperty(options={"HIDDEN"}, override=OVERRIDABLE)
    data: bpy.props.PointerProperty(type=bpy.types.Text, options={"HIDDEN"}, override=OVERRIDABLE)
    source: bpy.props.PointerProperty(
        type=bpy.types.Object,
        name="Source",
        description="The object that was captured",
        override=OVERRIDABLE,
    )
    plane: bpy.props.PointerProperty(type=bpy.types.Object, override=OVERRIDABLE)
    curve: bpy.props.PointerProperty(type=bpy.types.Object, override=OVERRIDABLE)
    marks: bpy.props.PointerProperty(type=bpy.types.Object, override=OVERRIDABLE)
    playhead: bpy.props.PointerProperty(type=bpy.types.Object, override=OVERRIDABLE)

    live: bpy.props.BoolProperty(
        name="Live",
        description="The mesh follows at once, in the viewport and in renders",
        default=True,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    follow: bpy.props.EnumProperty(
        name="Follow",
        description="What the shape of the mesh is taken from",
        items=FOLLOW,
        options={"ANIMATABLE"},
        override=OVERRIDABLE,
        update=tag_owner,
    )
    time: bpy.props.FloatProperty(
        name="Time",
        description=(
            "The captured frame that is shown, with all that lies between frames. Its curve in the "
            "Graph Editor says when: steeper is faster, flat stands still, falling runs backwards"
        ),
        default=1.0,
        precision=2,
        step=10,
        options={"ANIMATABLE"},
        override=OVERRIDABLE,
        update=tag_owner,
    )
    # Which captured frame is frame 0 of the sequence, and how far one frame is.
    first_frame: bpy.props.FloatProperty(default=1.0, options={"HIDDEN"}, override=OVERRIDABLE)
    frame_step: bpy.props.FloatProperty(default=1.0, options={"HIDDEN"}, override=OVERRIDABLE)
    fps: bpy.props.FloatProperty(
        name="Frame Rate",
        description="The frame rate that the sequence plays at with its present time curve",
        default=24.0,
        min=0.01,
        options=set(),
        override=OVERRIDABLE,
    )
    follow_driver: bpy.props.FloatProperty(options={"HIDDEN", "ANIMATABLE"}, override=OVERRIDABLE)
    summary: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)

    show_curve: bpy.props.BoolProperty(
        name="Curve",
        description="Draw the curve through the pose space",
        default=True,
        options=set(),
    )
    show_shapes: bpy.props.BoolProperty(
        name="Shapes",
        description="Draw the shapes that the pose space has at a grid of its points",
        default=True,
        options=set(),
    )
    shape_count: bpy.props.IntProperty(
        name="Detail",
        description="About how many shapes to draw: more of them where they differ",
        default=24,
        min=4,
        max=96,
        options=set(),
    )


class SequenceTransfer(bpy.types.PropertyGroup):
    """`Scene.exemplar_transfer`: what the next transfer is made from."""

    examples: bpy.props.PointerProperty(
        type=bpy.types.Object,
        name="From",
        description="The captured mesh with the poses that match, as shape keys",
        poll=lambda _self, obj: obj.type == "MESH" and obj.data.shape_keys is not None,
    )
    target: bpy.props.PointerProperty(
        type=bpy.types.Object,
        name="To",
        description="The other character, with shape keys of the same names",
        poll=lambda _self, obj: obj.type == "MESH" and obj.data.shape_keys is not None,
    )


classes = (CaptureProperties, SequenceProperties, SequenceTransfer)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(classes)


def register():
    _register_classes()
    bpy.types.Object.exemplar_capture = bpy.props.PointerProperty(
        type=CaptureProperties, name="Exemplar Capture"
    )
    bpy.types.Object.exemplar_sequence = bpy.props.PointerProperty(
        type=SequenceProperties, name="Exemplar Sequence", override=OVERRIDABLE
    )
    bpy.types.Scene.exemplar_transfer = bpy.props.PointerProperty(
        type=SequenceTransfer, name="Exemplar Transfer"
    )


def unregister():
    del bpy.types.Scene.exemplar_transfer
    del bpy.types.Object.exemplar_sequence
    del bpy.types.Object.exemplar_capture
    _unregister_classes()
