# SPDX-License-Identifier: GPL-3.0-or-later
"""Fast blended transformations: from few handles far away, noisy or of another size."""

from dataclasses import dataclass, replace

from ...native import Begin, BlendedBinding, BlendedSettings, Dictionary, Handles, Start
from ...native import Blended as NativeBlended
from .base import DeformerType


@dataclass(frozen=True)
class Settings:
    """Of a solve; the energies belong to the deformer, which makes its factors from them."""

    solve: BlendedSettings
    energies: tuple  # (constraint weight, smoothness)


class Deformer(NativeBlended):
    """Remembers the energies that it has, because setting them takes milliseconds."""

    energies = None

    def take(self, energies):
        if energies != self.energies:
            self.set_energies(*energies)
            self.energies = energies


class Blended(DeformerType):
    identifier = "BLENDED"
    label = "Few Points (Blended)"
    description = (
        "Guesses the whole shape from a few handles by what the exemplars have in common. "
        "For big jumps, for points that are noisy or of another size; handles are met closely, "
        "not exactly"
    )
    exemplars_needed = 0
    takes_exemplars = True
    handles_needed = 1

    def bind_settings(self, obj):
        own = obj.exemplar.blended
        return {
            "dictionary": own.dictionary,
            "eigenfunctions": own.eigenfunctions,
            "bones": own.bones,
            "atoms_kept": own.atoms_kept,
        }

    def words(self):
        return {
            "dictionary": "dictionary",
            "eigenfunctions": "number of patterns",
            "bones": "number of bones",
            "atoms_kept": "richness",
        }

    def build(self, mesh, gathered, progress):
        wanted = gathered.settings
        binding = BlendedBinding(
            dictionary=int(Dictionary[wanted["dictionary"]]),
            start_eigenfunction_count=min(4, wanted["eigenfunctions"]),
            eigenfunction_count=wanted["eigenfunctions"],
            bone_count=wanted["bones"],
            atoms_kept=wanted["atoms_kept"],
        )
        # A mesh without shape keys has one shape, which is as good an exemplar as any.
        exemplars = gathered.exemplars if len(gathered.exemplars) else gathered.reference[None]
        handles = Handles(gathered.kinds, gathered.vertex_sets)
        return Deformer(mesh, exemplars, handles, binding, progress=progress)

    def solve_settings(self, rig):
        own = rig.blended
        solve = BlendedSettings(
            sparsity=own.sparsity,
            begin=int(Begin[own.begin]),
            scale=own.scale,
            average_iterations=own.average_iterations,
            minimal_iterations=own.minimal_iterations,
            final_iterations=own.final_iterations,
            tolerance=own.tolerance,
        )
        return Settings(solve, (own.constraint_weight, own.smoothness))

    def solve(self, deformer, targets, settings, stateless):
        deformer.take(settings.energies)
        if stateless:
            return deformer.solve(targets, settings.solve)
        warm = replace(settings.solve, start=int(Start.WARM), final_iterations=0, tolerance=0.0)
        return deformer.solve(targets, warm)

    def note(self, deformer, settings):
        if not settings.solve.scale:
            return ""
        return f"scale {deformer.outcome().scale:.2f}"
