# SPDX-License-Identifier: GPL-3.0-or-later
"""As-multi-rigid-as-possible: exemplars that blend differently in every region."""

from dataclasses import replace

from ...native import Amrap as NativeAmrap
from ...native import AmrapSettings, Blend, Descent, Handles, Start
from .base import DeformerType


class Amrap(DeformerType):
    identifier = "AMRAP"
    label = "Local Blend (AMRAP)"
    description = (
        "Each region blends the exemplars in its own way, bent and turned to reach the handles. "
        "Real time, whatever the size of the mesh. For characters and faces with sculpted poses"
    )

    def bind_settings(self, obj):
        return {"edge_groups": obj.exemplar.amrap.edge_groups}

    def words(self):
        return {"edge_groups": "regions"}

    def build(self, mesh, gathered, progress):
        return NativeAmrap(
            mesh,
            gathered.exemplars,
            Handles(gathered.kinds, gathered.vertex_sets),
            edge_group_count=gathered.settings["edge_groups"],
            progress=progress,
        )

    def solve_settings(self, rig):
        own = rig.amrap
        return AmrapSettings(
            lambda_=own.lambda_,
            blend=int(Blend[own.blend]),
            rotations=own.rotations,
            descent=int(Descent[own.descent]),
            iterations=own.iterations,
            tolerance=own.tolerance,
        )

    def solve(self, deformer, targets, settings, stateless):
        if not stateless:
            settings = replace(settings, start=int(Start.WARM), iterations=0, tolerance=0.0)
        return deformer.solve(targets, settings)

    def blend_average(self, deformer):
        return deformer.blend_average()
