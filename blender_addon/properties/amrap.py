# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of AMRAP."""

import bpy

from .exemplars import OVERRIDABLE, tag_owner

BLENDS = (
    ("LOCAL", "Local", "Each region of the mesh blends the exemplars in its own way"),
    ("GLOBAL", "Global", "One blend of the exemplars for the whole mesh"),
)
DESCENTS = (
    ("AUTO", "Automatic", "Fast steps, and guarded ones as soon as the fast ones oscillate"),
    ("PLAIN", "Plain", "Fast steps only"),
    ("TRUST_REGION", "Guarded", "Steps that never make the result worse; slower"),
)


class AmrapProperties(bpy.types.PropertyGroup):
    lambda_: bpy.props.FloatProperty(
        name="Lambda",
        description=(
            "How much the result keeps close to single exemplars. 0: any mixture is as good as "
            "another; 0.5: passes through every exemplar on its way; large: jumps between them"
        ),
        default=0.5,
        min=0.0,
        soft_max=2.0,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    blend: bpy.props.EnumProperty(
        name="Blend",
        description="Whether regions of the mesh may blend the exemplars differently",
        items=BLENDS,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    rotations: bpy.props.BoolProperty(
        name="Rotations",
        description=(
            "Let parts of the exemplars turn to reach the handles. "
            "Switch off for faces: nothing turns there, and the result is faster and steadier"
        ),
        default=True,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    iterations: bpy.props.IntProperty(
        name="Iterations",
        description=(
            "Rounds of refinement a solve; at most as many, where Tolerance is not 0. "
            "0: chosen for you"
        ),
        default=0,
        min=0,
        soft_max=200,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    tolerance: bpy.props.FloatProperty(
        name="Tolerance",
        description=(
            "Refine until a round moves the pose by no more than this share of the mesh's size. "
            "0: a fixed number of rounds, which is quickest and gives the smoothest motion"
        ),
        default=0.0,
        min=0.0,
        soft_max=0.01,
        precision=6,
        step=0.001,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    descent: bpy.props.EnumProperty(
        name="Steps",
        description="How the solve goes towards the result",
        items=DESCENTS,
        override=OVERRIDABLE,
        update=tag_owner,
    )
    edge_groups: bpy.props.IntProperty(
        name="Regions",
        description=(
            "How many regions of the mesh may blend and turn by themselves. "
            "0: twice as many as there are handles. Takes effect at the next Bind"
        ),
        default=0,
        min=0,
        soft_max=200,
        options=set(),
        override=OVERRIDABLE,
        update=tag_owner,
    )


classes = (AmrapProperties,)
register, unregister = bpy.utils.register_classes_factory(classes)
