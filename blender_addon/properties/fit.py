# SPDX-License-Identifier: GPL-3.0-or-later
"""How a mesh is fitted to a scan: `Object.exemplar_fit`."""

import bpy


def is_mesh(_settings, obj):
    return obj.type == "MESH"


PLACES = (
    (
        "KEY",
        "Shape Key",
        "A shape key on this mesh, moved, turned and scaled back to the mesh at rest: an exemplar "
        "that you can use at once. Rename it to keep it when you fit again",
    ),
    (
        "OBJECT",
        "Separate Object",
        "A new object that lies where the scan lies. Rename it to keep it when you fit again",
    ),
)


class LandmarkItem(bpy.types.PropertyGroup):
    """One point that is known on the mesh and on the scan."""

    # `name` is what the list shows.
    vertex: bpy.props.IntProperty(
        name="Vertex", description="The vertex of the mesh", default=0, min=0
    )
    point: bpy.props.FloatVectorProperty(
        name="Point",
        description="Where the scan has it, in the scan's own space. Not used with an empty",
        size=3,
        subtype="XYZ",
    )
    empty: bpy.props.PointerProperty(
        name="Empty",
        description="An empty that marks the point on the scan, on every frame if it is animated",
        type=bpy.types.Object,
    )
    is_ambiguous: bpy.props.BoolProperty(
        name="Ambiguous",
        description=(
            "You do not know which of the ambiguous landmarks this point is: left or right, front "
            "or hind leg. Find Correspondence sorts them out"
        ),
    )
    residual: bpy.props.FloatProperty(options={"HIDDEN"}, default=-1.0)


class FitProperties(bpy.types.PropertyGroup):
    scan: bpy.props.PointerProperty(
        name="Scan",
        description=(
            "The mesh to fit to, of any connectivity: it may have holes, be in pieces, or be a "
            "cloud of points"
        ),
        type=bpy.types.Object,
        poll=is_mesh,
    )
    landmarks: bpy.props.CollectionProperty(type=LandmarkItem)
    landmark_index: bpy.props.IntProperty(
        name="Landmark", description="The landmark that the buttons are about", options=set()
    )
    place: bpy.props.EnumProperty(
        name="Result", description="Where the fitted shape goes", items=PLACES
    )
    find_scale: bpy.props.BoolProperty(
        name="Find Scale",
        description=(
            "The scan may be larger or smaller than the mesh. Off: it has the size of the mesh"
        ),
        default=True,
    )
    finish: bpy.props.BoolProperty(
        name="Take Detail",
        description=(
            "In the end every vertex moves by itself onto the scan, where there is any: wrinkles "
            "that no exemplar has. Off: the shape stays a mixture of the exemplars"
        ),
        default=True,
    )
    detail: bpy.props.FloatProperty(
        name="Detail",
        description="How closely the scan is followed in the end. Less for a noisy scan",
        default=1.0,
        min=0.001,
        soft_max=10.0,
    )
    reach: bpy.props.FloatProperty(
        name="Reach",
        description=(
            "How far from the shape, in percent of the mesh's size, a point of the scan may lie "
            "at first to be taken for a part of it"
        ),
        default=15.0,
        min=0.1,
        max=100.0,
        subtype="PERCENTAGE",
    )
    disc_radius: bpy.props.FloatProperty(
        name="Landmark Size",
        description=(
            "Landmarks are averages over discs of up to this radius, in percent of the mesh's "
            "size, which noise hardly moves. 0: the single points, for exact ones"
        ),
        default=15.0,
        min=0.0,
        max=50.0,
        subtype="PERCENTAGE",
    )
    use_colours: bpy.props.BoolProperty(
        name="Colour the Distance",
        description=(
            "Write a colour attribute to the result and to the scan: from blue, where they meet, "
            "to red, where they are farthest apart; grey where there is no counterpart"
        ),
        default=True,
    )
    use_matches: bpy.props.BoolProperty(
        name="Write Correspondence",
        description=(
            "Write to the scan which vertex of the mesh each of its points is, as an attribute "
            "of whole numbers; -1 for none"
        ),
        default=True,
    )
    use_scene_range: bpy.props.BoolProperty(
        name="Scene Range",
        description="Fit from the scene's first frame to its last",
        default=True,
    )
    frame_start: bpy.props.IntProperty(name="Start", description="The first frame", default=1)
    frame_end: bpy.props.IntProperty(name="End", description="The last frame", default=250)
    frame_step: bpy.props.IntProperty(
        name="Step", description="Fit every so many frames", default=1, min=1, soft_max=10
    )
    filepath: bpy.props.StringProperty(
        name="File",
        description=(
            "The cache file that the fitted frames are written to; // is the folder of the .blend "
            "file. Empty: named after the object, beside the .blend file"
        ),
        subtype="FILE_PATH",
    )
    # What the last fit made and said.
    last_key: bpy.props.StringProperty(options={"HIDDEN"})
    last_object: bpy.props.PointerProperty(type=bpy.types.Object, options={"HIDDEN"})
    message: bpy.props.StringProperty(options={"HIDDEN"})
    is_doubtful: bpy.props.BoolProperty(options={"HIDDEN"})


classes = (LandmarkItem, FitProperties)
_register_classes, _unregister_classes = bpy.utils.register_classes_factory(classes)


def register():
    _register_classes()
    bpy.types.Object.exemplar_fit = bpy.props.PointerProperty(
        type=FitProperties, name="Exemplar Fit"
    )


def unregister():
    del bpy.types.Object.exemplar_fit
    _unregister_classes()
