# SPDX-License-Identifier: GPL-3.0-or-later
"""Everything that a bind needs from an object, checked in the artist's words.

The library checks as well; what is checked here is what can be said better with names of shape
keys and empties at hand.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy

from ..native import Element, ExemplarError, Kind, Status
from ..native.library import library
from . import deformers, exemplars, fingerprint, handles, meshes, versions
from .parts import components


@dataclass
class BindInputs:
    deformer: str  # identifier of its kind
    settings: dict  # of the kind, that take effect at Bind
    live: Any  # deformers.base.Live or None
    names: list  # of the exemplars
    reference: numpy.ndarray  # float32 [V][3]
    triangles: numpy.ndarray  # uint32 [F][3]
    exemplars: numpy.ndarray  # float32 [S][V][3]; S is 0 for kinds that take none
    labels: list  # of the handles
    kinds: list  # [H]
    radii: list  # [H]
    vertex_sets: list  # [H] uint32 arrays
    topology: str
    centres: numpy.ndarray = field(init=False)  # float64 [H][3]

    def __post_init__(self):
        reference = self.reference.astype(numpy.float64)
        self.centres = numpy.array([reference[v].mean(axis=0) for v in self.vertex_sets])


def for_bind(obj):
    """What the artist has set up now. Raises ExemplarError with what is missing."""
    library()
    handles.adopt_renamed_groups(obj)
    type_ = deformers.chosen(obj)
    keys = _enabled_keys(obj, type_)
    items = list(obj.exemplar.handles)
    _check_handles(items, type_.handles_needed)
    kinds = [int(Kind[item.kind]) for item in items]
    radii = [item.radius for item in items]
    gathered = _gather(obj, type_, type_.bind_settings(obj), keys, items, kinds, radii)
    _check_parts(gathered)
    return gathered


def as_bound(obj, exemplar_names):
    """What the object was bound to: the same handles and exemplars as then, wherever they are."""
    handles.adopt_renamed_groups(obj)
    keys = [obj.data.shape_keys.key_blocks[name] for name in exemplar_names]
    items = handles.bound_items(obj)
    kinds = [item.bound_kind for item in items]
    radii = [item.bound_radius for item in items]
    settings = fingerprint.read(obj)["settings"]
    return _gather(obj, deformers.bound(obj), settings, keys, items, kinds, radii)


def _gather(obj, type_, settings, keys, items, kinds, radii):
    count = len(obj.data.vertices)
    for index, key in enumerate(keys):
        check_size(obj, key, index)
    reference = meshes.reference_positions(obj)
    check_finite(meshes.reference_name(obj), reference)
    poses = numpy.empty((len(keys), count, 3), numpy.float32)
    for index, key in enumerate(keys):
        poses[index] = versions.get_key_positions(key)
        check_finite(f"Shape key '{key.name}'", poses[index], index)
    triangles = meshes.triangles(obj.data)
    if not len(triangles):
        raise ExemplarError(f"'{obj.name}' has no faces.")
    return BindInputs(
        deformer=type_.identifier,
        settings=settings,
        live=type_.live_data(obj),
        names=[key.name for key in keys],
        reference=reference,
        triangles=triangles,
        exemplars=poses,
        labels=[handles.label(item) for item in items],
        kinds=kinds,
        radii=radii,
        vertex_sets=handles.vertex_sets(obj, items, radii, reference),
        topology=meshes.topology_digest(obj.data),
    )


def _enabled_keys(obj, type_):
    if not type_.takes_exemplars:
        return []
    if type_.exemplars_needed and not meshes.exemplar_keys(obj):
        raise ExemplarError(
            f"'{obj.name}' has no shape keys. Sculpt its poses as shape keys first: "
            "Object Data Properties, Shape Keys."
        )
    names = exemplars.enabled_names(obj)
    if len(names) < type_.exemplars_needed:
        have = "Only one exemplar is" if names else "No exemplar is"
        want = exemplars.at_least(type_.exemplars_needed)
        raise ExemplarError(f"{have} switched on. Switch on {want}.")
    return [obj.data.shape_keys.key_blocks[name] for name in names]


def check_size(obj, key, index=None):
    """Raise ExemplarError where a key and its mesh have come apart."""
    size, count = versions.key_size(key), len(obj.data.vertices)
    if size != count:
        raise ExemplarError(
            f"Shape key '{key.name}' has {size} points, the mesh has {count} vertices. "
            "Enter and leave Edit Mode once, or remove the key.",
            element=Element.EXEMPLAR,
            index=index,
        )


def check_finite(name, positions, index=None):
    bad = numpy.flatnonzero(~numpy.isfinite(positions).all(axis=1))
    if len(bad):
        more = f" and {len(bad) - 1} more" if len(bad) > 1 else ""
        raise ExemplarError(
            f"{name} has coordinates that are not numbers, at vertex {bad[0]}{more}.",
            element=Element.EXEMPLAR,
            index=index,
            vertices=bad,
        )


def _check_handles(items, needed):
    if len(items) < needed:
        have = "There is one handle" if items else "There are no handles"
        want = "one or more are" if needed == 1 else "two or more are"
        raise ExemplarError(
            f"{have}; {want} needed. Select vertices in Edit Mode and press Add Handle."
        )
    for index, item in enumerate(items):
        if handles.is_missing(item):
            raise ExemplarError(
                f"The empty of handle '{handles.label(item)}' was deleted. Remove the handle.",
                element=Element.HANDLE,
                index=index,
            )
    if all(item.kind == "FREE" for item in items):
        raise ExemplarError(
            "Every handle is free, so nothing holds the mesh. Make a handle pinned or oriented."
        )


def _check_parts(inputs):
    """Every connected part needs a handle that holds it."""
    labels = components(len(inputs.reference), inputs.triangles)
    held, touched = set(), set()
    for kind, vertices in zip(inputs.kinds, inputs.vertex_sets):
        parts = set(labels[vertices].tolist())
        touched |= parts
        if kind != Kind.FREE:
            held |= parts
    loose = sorted(set(labels.tolist()) - held)
    if not loose:
        return
    vertices = numpy.flatnonzero(numpy.isin(labels, loose))
    if touched.issuperset(loose):
        what = "has only free handles. Make one of them pinned or oriented"
    else:
        what = "has no pinned or oriented handle. Add one there, or join or delete it"
    count = f"One loose part ({len(vertices)} vertices)" if len(loose) == 1 else None
    count = count or f"Each of {len(loose)} loose parts ({len(vertices)} vertices)"
    raise ExemplarError(
        f"{count} {what}.",
        status=Status.ERROR_UNCONSTRAINED,
        element=Element.VERTEX,
        index=int(vertices[0]),
        vertices=vertices,
    )
