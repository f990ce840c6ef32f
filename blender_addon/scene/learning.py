# SPDX-License-Identifier: GPL-3.0-or-later
"""Stiffness learned from poses [Rigidity, 3.4].

    problem = from_keys(obj)        # or: from_animation(...), which walks through the frames
    radii = learn(problem, report)  # slow; may run in a thread
"""

from contextlib import closing
from dataclasses import dataclass

import numpy

from ..native import ExemplarError, Mesh, learn_radii
from . import exemplars, inputs, meshes, stiffness, versions
from .baking.frames import walk

# Poses that differ from the rest by less than this share of the mesh's size say nothing.
SAME = 1e-6


@dataclass(frozen=True)
class Problem:
    reference: numpy.ndarray  # float32 [V][3]
    triangles: numpy.ndarray  # uint32 [F][3]
    poses: numpy.ndarray  # float32 [M][V][3]
    radius_min: int
    radius_max: int
    omega: float


def learn(problem, report=None):
    """Radii int32 [V]. Sees no Blender data."""
    with Mesh(problem.reference, problem.triangles) as mesh:
        return learn_radii(
            mesh,
            problem.poses,
            problem.radius_min,
            problem.radius_max,
            problem.omega,
            report,
        )


def from_keys(obj):
    """The exemplars that are switched on, without the Basis."""
    reference = meshes.reference_key(obj)
    if reference is None:
        raise ExemplarError(
            f"'{obj.name}' has no shape keys to learn from. Sculpt poses, or learn from animation."
        )
    names = [name for name in exemplars.enabled_names(obj) if name != reference.name]
    if not names:
        raise ExemplarError(
            f"Only '{reference.name}' is switched on. Learning needs at least one exemplar beside "
            "it, to see what bends."
        )
    blocks = obj.data.shape_keys.key_blocks
    poses = []
    for index, name in enumerate(names):
        inputs.check_size(obj, blocks[name], index)
        poses.append(versions.get_key_positions(blocks[name]))
        inputs.check_finite(f"Shape key '{name}'", poses[-1], index)
    return _problem(obj, poses)


def from_animation(obj, animated, scene, depsgraph_of, frames):
    """Generator of (fraction, stage) that returns a Problem: `animated` as it is evaluated on each
    of `frames`. Nothing is changed; the scene goes back to its frame however this ends.

    depsgraph_of  called on each frame, for an evaluated depsgraph
    """
    poses = []
    with closing(walk(scene, frames)) as numbers:
        for done, frame in enumerate(numbers):
            poses.append(_evaluated(obj, animated, depsgraph_of(), frame))
            yield done / len(frames), f"frame {frame}"
    return _problem(obj, poses)


def _evaluated(obj, animated, depsgraph, frame):
    mesh = animated.evaluated_get(depsgraph).data
    count = len(obj.data.vertices)
    if len(mesh.vertices) != count:
        raise ExemplarError(
            f"'{animated.name}' has {len(mesh.vertices)} vertices on frame {frame}, and "
            f"'{obj.name}' has {count}. They must be alike: switch off modifiers that add or "
            "remove vertices."
        )
    if meshes.topology_digest(mesh) != meshes.topology_digest(obj.data):
        raise ExemplarError(
            f"'{animated.name}' has other faces than '{obj.name}' on frame {frame}, though as many "
            "vertices. Choose an object with the same mesh."
        )
    positions = versions.get_mesh_positions(mesh)
    inputs.check_finite(f"'{animated.name}' on frame {frame}", positions)
    return positions


def _problem(obj, poses):
    stiffness.check_range(obj)
    own = obj.exemplar.rigidity
    if own.radius_min == own.radius_max:
        raise ExemplarError("Softest and Stiffest are the same, so there is nothing to learn.")
    reference = meshes.reference_positions(obj)
    inputs.check_finite(meshes.reference_name(obj), reference)
    triangles = meshes.triangles(obj.data)
    if not len(triangles):
        raise ExemplarError(f"'{obj.name}' has no faces.")
    size = numpy.linalg.norm(numpy.ptp(reference, axis=0))
    differ = [pose for pose in poses if numpy.abs(pose - reference).max() > SAME * size]
    if not differ:
        raise ExemplarError(
            "Every pose is the same as the mesh at rest: nothing bends, so there is nothing to "
            "learn from."
        )
    return Problem(
        reference,
        triangles,
        numpy.array(differ, numpy.float32),
        own.radius_min,
        own.radius_max,
        own.omega,
    )
