# SPDX-License-Identifier: GPL-3.0-or-later
"""As-rigid-as-possible, of a stiffness that is painted or learned. Needs no exemplars."""

from dataclasses import replace

from ...native import Handles, RigiditySettings, Start
from ...native import Rigidity as NativeRigidity
from .. import meshes, stiffness
from .base import DeformerType, Live

# Vertices times iterations of one step of a drag: about a thirtieth of a second.
DRAG_WORK = 150_000


class Rigidity(DeformerType):
    identifier = "RIGIDITY"
    label = "Stiffness (Rigidity)"
    description = (
        "The mesh bends like a material, soft where you paint it soft and stiff where you paint it "
        "stiff. Every vertex moves by itself. Needs no exemplars, and can learn from them what is "
        "stiff"
    )
    exemplars_needed = 0
    takes_exemplars = False
    handles_needed = 1

    def bind_settings(self, obj):
        return {"handle_size": obj.exemplar.rigidity.handle_size}

    def words(self):
        return {"handle_size": "size of small handles"}

    def live_key(self, obj):
        return stiffness.key(obj)

    def live_data(self, obj):
        radii = stiffness.radii(obj)
        return Live(meshes.digest(radii), radii)

    def build(self, mesh, gathered, progress):
        return NativeRigidity(
            mesh,
            Handles(gathered.kinds, gathered.vertex_sets),
            gathered.live.data,
            gathered.settings["handle_size"],
            progress,
        )

    def apply(self, deformer, gathered):
        deformer.set_radii(gathered.live.data)

    def solve_settings(self, rig):
        own = rig.rigidity
        return RigiditySettings(
            tolerance=own.tolerance,
            iterations=own.iterations,
            acceleration=own.acceleration,
        )

    def solve(self, deformer, targets, settings, stateless):
        if stateless:
            return deformer.solve(targets, settings)
        cap = max(3, DRAG_WORK // deformer.info.vertex_count)
        settings = replace(settings, start=int(Start.WARM), iterations=cap)
        # That a step of a drag has further to go is no news to anyone.
        return replace(deformer.solve(targets, settings), warning="", capped=False)
