# SPDX-License-Identifier: GPL-3.0-or-later
"""What a fit leaves behind: a shape key or an object, colours, correspondences, a sentence."""

import bpy
import numpy

from ...native import ExemplarError
from ...native.declarations import UNSEEN
from .. import colours, rigs, versions

DISTANCE = "Fit Distance"
VERTEX = "Fit Vertex"
GREY = (0.35, 0.35, 0.35, 1.0)


def refuse(obj):
    """Raise ExemplarError where the result cannot be written."""
    if obj.library is not None or (
        obj.exemplar_fit.place == "KEY" and obj.data.library is not None
    ):
        raise ExemplarError(f"'{obj.name}' is linked. Make a local copy, or a separate object.")


def write(obj, gathered, fitted):
    own = obj.exemplar_fit
    if own.place == "KEY":
        shown = _write_key(obj, gathered.shape.reference, fitted.positions)
    else:
        shown = write_object(obj, fitted.positions)
    scan = own.scan
    fits_scan = len(scan.data.vertices) == len(fitted.matches.vertices)
    if own.use_colours:
        _colour(shown.data, fitted.distances)
        if fits_scan and scan.data.library is None:
            seen = fitted.matches.vertices != UNSEEN
            _colour(scan.data, numpy.where(seen, fitted.matches.distances, numpy.nan))
    if own.use_matches and fits_scan and scan.data.library is None:
        _write_vertices(scan.data, fitted.matches.vertices)
    for item, residual in zip(own.landmarks, fitted.residuals):
        item.residual = float(residual)
    own.message, own.is_doubtful = sentence(own, fitted.report), bool(fitted.report.warning)
    return shown


def sentence(own, report):
    """What the artist should know of a fit."""
    text = (
        f"Explains {report.quality:.0%} of the scan, sees {report.seen:.0%} of the mesh; "
        f"{report.residual:.3g} apart on average, {report.scale:.3g} times the size"
    )
    if own.landmarks and report.worst_landmark < len(own.landmarks):
        text += f". Worst landmark: {own.landmarks[report.worst_landmark].name}"
    return f"{report.warning}. {text}" if report.warning else text


def _write_key(obj, reference, positions):
    """A key named after the scan; that of the last fit, unless it was renamed to be kept."""
    own = obj.exemplar_fit
    if obj.data.shape_keys is None:
        obj.shape_key_add(name="Basis", from_mix=False)
    blocks = obj.data.shape_keys.key_blocks
    key = blocks.get(own.last_key) if own.last_key else None
    if key is None:
        key = obj.shape_key_add(name=f"Fit {own.scan.name}", from_mix=False)
        own.last_key = key.name
    placed = onto(positions, reference)
    versions.set_key_positions(key, numpy.ascontiguousarray(placed, numpy.float32))
    key.value = 1.0
    obj.active_shape_key_index = blocks.find(key.name)
    obj.data.update_tag()
    return obj


def write_object(obj, positions, name=None):
    """An object of its own, without shape keys or modifiers, that lies as `obj` does."""
    own = obj.exemplar_fit
    name = name or f"{obj.name} Fit"
    shown = own.last_object
    is_ours = shown is not None and rigs.is_in_scene(shown) and shown.name == name
    if not is_ours or len(shown.data.vertices) != len(positions):
        mesh = obj.data.copy()
        shown = bpy.data.objects.new(name, mesh)
        shown.shape_key_clear()
        mesh.name = shown.name
        for collection in obj.users_collection:
            collection.objects.link(shown)
        own.last_object = shown
    shown.matrix_world = obj.matrix_world
    versions.set_mesh_positions(shown.data, numpy.ascontiguousarray(positions, numpy.float32))
    shown.data.update()
    return shown


def onto(positions, reference):
    """Positions moved, turned and scaled to lie on a reference as well as they can, in least
    squares [Umeyama, "Least-squares estimation of transformation parameters between two point
    patterns", PAMI 1991]."""
    source, target = positions.astype(numpy.float64), reference.astype(numpy.float64)
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, sizes, v = numpy.linalg.svd(a.T @ b)
    handedness = numpy.sign(numpy.linalg.det(u @ v)) or 1.0
    sizes[2] *= handedness
    u[:, 2] *= handedness
    spread = (a * a).sum()
    scale = sizes.sum() / spread if spread > 0 else 1.0
    return scale * (a @ (u @ v)) + target.mean(axis=0)


# -------------------------------------------------------------------------------------- attributes


def _colour(mesh, distances):
    """float32 [n]; nan is grey. Red is what one in twenty is beyond."""
    known = numpy.isfinite(distances)
    most = numpy.quantile(distances[known], 0.95) if known.any() else 1.0
    found = colours.of(numpy.where(known, distances, 0) / (most or 1.0))
    found[~known] = GREY
    colours.write(mesh, DISTANCE, found)


def _write_vertices(mesh, vertices):
    layer = mesh.attributes.get(VERTEX)
    if layer is None:
        layer = mesh.attributes.new(VERTEX, "INT", "POINT")
    layer.data.foreach_set(
        "value", numpy.where(vertices == UNSEEN, -1, vertices).astype(numpy.int32)
    )
    mesh.update()
