# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of Blended."""

import bpy

from .exemplars import OVERRIDABLE, tag_owner

DICTIONARIES = (
    (
        "EIGENFUNCTIONS",
        "Patterns",
        "Smooth patterns over the surface, like those of a drum. For bodies that bend everywhere",
    ),
    (
        "SKELETON",
        "Skeleton",
        "Bones and skinning weights found in the exemplars. For characters with limbs and joints",
    ),
)
BEGINS = (
    ("SPARSE", "Sparse", "Begin with as few patterns as explain the handles. Best for few handles"),
    ("PLAIN", "Plain", "Begin with all patterns at once. Quicker"),
)


class BlendedProperties(bpy.types.PropertyGroup):
    dictionary: bpy.props.EnumProperty(
        name="Dictionary",
        description="What deformations are made of. Takes effect at the next Bind",
        items=DICTIONARIES,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    eigenfunctions: bpy.props.IntProperty(
        name="Patterns (m)",
        description=(
            "How many patterns. Few: broad, smooth bends only; many: finer bends, but more that "
            "the handles cannot tell apart. Takes effect at the next Bind"
        ),
        default=15,
        min=1,
        soft_min=4,
        soft_max=60,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    bones: bpy.props.IntProperty(
        name="Bones",
        description=(
            "How many bones; each region of a bone turns as one. "
            "0: as many as the exemplars show to move. Takes effect at the next Bind"
        ),
        default=0,
        min=0,
        soft_max=60,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )
    atoms_kept: bpy.props.FloatProperty(
        name="Richness",
        description=(
            "The share of the deformations that is kept of those that look alike. "
            "1: all, slower; less: quicker, and a little coarser. Takes effect at the next Bind"
        ),
        default=0.5,
        min=0.05,
        max=1.0,
        subtype="FACTOR",
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )

    constraint_weight: bpy.props.FloatProperty(
        name="Pull",
        description=(
            "Beta lc: how hard the mesh is pulled to its handles. Large: it meets them, even if "
            "that looks strained; small: it keeps a natural shape and passes them by, which is "
            "right for noisy points"
        ),
        default=30.0,
        min=0.01,
        soft_min=1.0,
        soft_max=1000.0,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    smoothness: bpy.props.FloatProperty(
        name="Smooth",
        description=(
            "Beta sm: how much broad bends are preferred to fine ones. Large: limbs bend softly "
            "and details move less; 0: bends may be as sharp as the patterns allow"
        ),
        default=1e-6,
        min=0.0,
        soft_max=0.01,
        precision=7,
        step=0.0001,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    sparsity: bpy.props.FloatProperty(
        name="Sparsity",
        description=(
            "Beta sp: how few patterns the first guess may use. Large: a plainer guess, safer "
            "with very few handles; small: a guess that follows every handle"
        ),
        default=0.01,
        min=0.0,
        soft_max=1.0,
        precision=4,
        step=0.1,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    begin: bpy.props.EnumProperty(
        name="First Guess",
        description="How a solve begins",
        items=BEGINS,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    scale: bpy.props.BoolProperty(
        name="Scale",
        description=(
            "Let the whole mesh grow or shrink to what the handles say, as for points of another "
            "size. Off: the size of the exemplars is kept"
        ),
        default=False,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    average_iterations: bpy.props.IntProperty(
        name="Average Rounds",
        description="Rounds near the mean of all exemplars, which finds the broad pose. 0: none",
        default=8,
        min=0,
        soft_max=50,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    minimal_iterations: bpy.props.IntProperty(
        name="Nearest Rounds",
        description="Rounds near each single exemplar, of which the best is kept",
        default=8,
        min=1,
        soft_max=50,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    final_iterations: bpy.props.IntProperty(
        name="Final Rounds",
        description="Rounds with the whole dictionary, for the fine bends. 0: chosen for you",
        default=0,
        min=0,
        soft_max=100,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description=(
            "End a stage when a round lowers its energy by no more than this share. "
            "0: just as many rounds as asked for, which gives the smoothest motion"
        ),
        default=0.0,
        min=0.0,
        soft_max=0.01,
        precision=6,
        step=0.001,
        override=OVERRIDABLE,
        update=tag_owner,
    )

    # JSON: the vertex groups that Skinning Weights made, to be replaced by the next.
    skin_groups: bpy.props.StringProperty(options={"HIDDEN"}, override=OVERRIDABLE)


classes = (BlendedProperties,)
register, unregister = bpy.utils.register_classes_factory(classes)
