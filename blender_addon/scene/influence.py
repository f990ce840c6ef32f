# SPDX-License-Identifier: GPL-3.0-or-later
"""How much of one exemplar each region of the result is made of, as colours on the mesh."""

from ..native import ExemplarError
from . import bindings, colours, deformers, fingerprint, live, results

ATTRIBUTE = "Exemplar Influence"


def weights(obj, name):
    """float64 [V]: the share of exemplar `name` in the present result."""
    state = bindings.ensure(obj)
    if not hasattr(state.deformer, "blend_weights"):
        label = deformers.bound(obj).label
        raise ExemplarError(f"{label} does not blend exemplars by region.")
    names = fingerprint.names(obj)
    if name not in names:
        raise ExemplarError(f"'{name}' was not an exemplar at Bind. Choose one that was.")
    live.update(obj)
    with state.deformer.lock:
        blend = state.deformer.blend_weights()[:, names.index(name)]
        return blend[state.deformer.edge_groups()]


def show(obj, name):
    """Write the colours to the mesh that shows the result; returns the least and the greatest."""
    found = weights(obj, name)
    mesh = results.shown_object(obj).data
    if mesh.library is not None:
        raise ExemplarError(f"The mesh of '{obj.name}' is linked, and can take no colours.")
    colours.write(mesh, ATTRIBUTE, colours.of(found))
    return float(found.min()), float(found.max())


def hide(obj):
    """Take the colours away. True where there were any."""
    shown = results.shown_object(obj) or obj
    layer = shown.data.color_attributes.get(ATTRIBUTE)
    if layer is None:
        return False
    shown.data.color_attributes.remove(layer)
    shown.data.update()
    return True
