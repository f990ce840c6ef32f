# SPDX-License-Identifier: GPL-3.0-or-later
"""Experiments of registration: a left-out pose, cut up, moved and scanned; and what is compared.

Lengths are shares of the target's size, the root of its area, as in the paper's figure 7.
"""

import sys
from dataclasses import dataclass

import numpy
from inputs import DATA, ROOT, Missing
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

sys.path.insert(0, str(ROOT / "blender_addon"))

import native  # noqa: E402

PROTECTED = 0.15  # nothing is removed within this distance of a landmark


@dataclass
class Case:
    faces: numpy.ndarray
    exemplars: numpy.ndarray  # [8][V][3]
    target: numpy.ndarray  # [V][3] the whole left-out pose, where the scan is
    size: float
    landmarks: numpy.ndarray  # vertices
    landmark_points: numpy.ndarray
    points: numpy.ndarray  # of the scan
    triangles: numpy.ndarray
    kept: numpy.ndarray  # the target's vertices that are the scan's points


def load(name):
    path = DATA / f"{name}.npz"
    if not path.exists():
        raise Missing(f"{name}.npz is not in the folder of real meshes (EXEMPLAR_DATA)")
    with numpy.load(path) as arrays:
        return arrays["poses"].astype(numpy.float64), arrays["faces"].astype(numpy.uint32)


def face_normals(points, faces):
    corners = points[faces]
    return numpy.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])


def area(points, faces):
    return numpy.linalg.norm(face_normals(points, faces), axis=1).sum() / 2


def vertex_areas(points, faces):
    thirds = numpy.repeat(numpy.linalg.norm(face_normals(points, faces), axis=1) / 6, 3)
    return numpy.bincount(faces.ravel(), thirds, len(points))


def vertex_normals(points, faces):
    normals = numpy.zeros_like(points)
    for corner in range(3):
        numpy.add.at(normals, faces[:, corner], face_normals(points, faces))
    return normals / numpy.maximum(numpy.linalg.norm(normals, axis=1), 1e-300)[:, None]


def farthest(points, count, first):
    chosen, distance = [first], numpy.full(len(points), numpy.inf)
    while len(chosen) < count:
        distance = numpy.minimum(distance, ((points - points[chosen[-1]]) ** 2).sum(1))
        chosen.append(int(distance.argmax()))
    return numpy.array(chosen)


def cut_up(points, faces, landmarks, share, rng):
    """Discs are taken off until `share` of the area is left; those around landmarks stay."""
    count, size = len(points), numpy.sqrt(area(points, faces))
    edges = numpy.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    lengths = numpy.linalg.norm(points[edges[:, 0]] - points[edges[:, 1]], axis=1)
    graph = coo_matrix((lengths, edges.T), (count, count)).tocsr()
    graph = graph.maximum(graph.T)
    around = dijkstra(graph, indices=landmarks, limit=PROTECTED * size, min_only=True)
    is_protected = numpy.isfinite(around)
    areas = vertex_areas(points, faces)
    gone = numpy.zeros(count, bool)
    for seed in rng.permutation(numpy.flatnonzero(~is_protected)):
        if areas[~gone].sum() <= share * areas.sum():
            break
        radius = size * rng.uniform(0.1, 0.25)
        disc = numpy.isfinite(dijkstra(graph, indices=[seed], limit=radius, min_only=True))
        more = gone | (disc & ~is_protected)
        if areas[~more].sum() >= 0.97 * share * areas.sum():
            gone = more
    kept_faces = faces[(~gone)[faces].all(1)]
    used = numpy.unique(kept_faces)
    new = numpy.zeros(count, numpy.uint32)
    new[used] = numpy.arange(len(used))
    return used, new[kept_faces]


def turn_of(rng):
    q, r = numpy.linalg.qr(rng.normal(size=(3, 3)))
    q = q * numpy.sign(numpy.diag(r))
    return q if numpy.linalg.det(q) > 0 else -q


def make(poses, faces, seed, landmarks=8, share=0.6, noise=0.0, scale=1.0, wrong=0, shapes=8):
    """A random experiment. `wrong` landmarks are on other places of the scan."""
    rng = numpy.random.default_rng(seed)
    order = rng.permutation(len(poses))
    target = poses[order[0]]
    exemplars = poses[order[1 : 1 + shapes]]
    chosen = farthest(exemplars[0], landmarks, int(rng.integers(len(target))))
    kept, triangles = cut_up(target, faces, chosen, share, rng)
    target = scale * target @ turn_of(rng).T + rng.normal(size=3)
    size = numpy.sqrt(area(target, faces))
    points = target[kept] + noise * size * rng.normal(size=(len(kept), 3))
    places = target[chosen] + noise * size * rng.normal(size=(len(chosen), 3))
    for index in rng.permutation(landmarks)[:wrong]:
        places[index] = points[rng.integers(len(points))]
    return Case(faces, exemplars, target, size, chosen, places, points, triangles, kept)


@dataclass
class Outcome:
    """Errors as shares of the size: of every vertex, and of every point of the scan (infinite where
    it has no correspondence)."""

    deformation: numpy.ndarray
    correspondence: numpy.ndarray
    quality: float = numpy.nan
    scale: float = numpy.nan
    warning: str = ""


def _judge(case, positions, triangles, barycentric, **more):
    deformation = numpy.linalg.norm(positions - case.target, axis=1) / case.size
    correspondence = numpy.full(len(case.points), numpy.inf)
    there = triangles != native.UNSEEN
    corners = case.target[case.faces[triangles[there]]]
    places = (corners * barycentric[there][:, :, None]).sum(1)
    off = places - case.target[case.kept][there]
    correspondence[there] = numpy.linalg.norm(off, axis=1) / case.size
    return Outcome(deformation, correspondence, **more)


def ours(case, shapes, **settings):
    """Registration with the first `shapes` exemplars."""
    mesh = native.Mesh(case.exemplars[0], case.faces)
    with native.Registration(mesh, case.exemplars[:shapes]) as registration:
        scan = native.Scan(case.points, case.triangles)
        report = registration.fit(
            scan, case.landmarks, case.landmark_points, native.ScanFitSettings(**settings)
        )
        found = registration.scan_matches()
        return _judge(
            case,
            registration.positions().astype(float),
            found.triangles,
            found.barycentric,
            quality=report.quality,
            scale=report.scale,
            warning=report.warning,
        )


# ---------------------------------------------------------------------------------------- peers


def _nearest_vertices(case, positions):
    """Correspondences of a peer: each point's nearest vertex, as a corner of a triangle."""
    _, vertices = cKDTree(positions).query(case.points)
    triangle_of = numpy.zeros(len(positions), numpy.uint32)
    corner_of = numpy.zeros(len(positions), int)
    for corner in range(3):
        triangle_of[case.faces[:, corner]] = numpy.arange(len(case.faces))
        corner_of[case.faces[:, corner]] = corner
    return triangle_of[vertices], numpy.eye(3)[corner_of[vertices]]


def similarity(source, target):
    """Umeyama's least squares: (scale, turn, shift)."""
    a, b = source - source.mean(0), target - target.mean(0)
    u, s, vt = numpy.linalg.svd(b.T @ a)
    sign = numpy.array([1, 1, numpy.sign(numpy.linalg.det(u @ vt))])
    turn = u * sign @ vt
    scale = (s * sign).sum() / (a * a).sum()
    return scale, turn, target.mean(0) - scale * turn @ source.mean(0)


def rigid(case, rounds=30):
    """The best exemplar, aligned by landmarks and then by ICP with the nearer nine tenths."""
    best = None
    tree_of_scan = case.points
    for exemplar in case.exemplars:
        scale, turn, shift = similarity(exemplar[case.landmarks], case.landmark_points)
        positions = scale * exemplar @ turn.T + shift
        for _ in range(rounds):
            distance, vertices = cKDTree(positions).query(tree_of_scan)
            near = distance <= numpy.quantile(distance, 0.9)
            scale, turn, shift = similarity(exemplar[vertices[near]], case.points[near])
            positions = scale * exemplar @ turn.T + shift
        distance, _ = cKDTree(positions).query(case.points)
        residual = numpy.sqrt((distance**2).mean())
        if best is None or residual < best[0]:
            best = residual, positions
    return _judge(case, best[1], *_nearest_vertices(case, best[1]))


def rigidity_alone(case, rounds=6, samples=1500, reach=0.15):
    """Non-rigid ICP without exemplars: our Rigidity deformer on the first one, its landmarks held,
    then as many vertices as find a counterpart."""
    shape = case.exemplars[0]
    scale, turn, shift = similarity(shape[case.landmarks], case.landmark_points)
    mesh = native.Mesh(scale * shape @ turn.T + shift, case.faces)
    scan = native.Scan(case.points, case.triangles)
    points, _, scan_normals, boundary = scan.arrays()
    tree = cKDTree(points)
    chosen = farthest(shape, samples, 0)

    def targets(places):
        held = numpy.zeros((len(places), 3, 4))
        held[:, :, :3] = numpy.eye(3)
        held[:, :, 3] = places
        return held

    def handles(vertices):
        return native.Handles([native.Kind.PINNED] * len(vertices), [[v] for v in vertices])

    deformer = native.Rigidity(mesh, handles(case.landmarks), handle_size=0)
    deformer.solve(targets(case.landmark_points))
    for index in range(rounds):
        positions = deformer.positions().astype(float)
        normals = vertex_normals(positions, case.faces)[chosen]
        distance, found = tree.query(positions[chosen])
        limit = case.size * reach * (1 - index / rounds)
        agrees = (scan_normals[found] * normals).sum(1) > 0.5
        agrees &= (distance < limit) & ~boundary[found] & ~numpy.isin(chosen, case.landmarks)
        held = numpy.concatenate([case.landmarks, chosen[agrees]])
        places = numpy.concatenate([case.landmark_points, points[found[agrees]]])
        deformer.set_handles(handles(held))
        deformer.solve(
            targets(places),
            native.RigiditySettings(start=native.Start.POSITIONS),
            positions=positions,
        )
    positions = deformer.positions().astype(float)
    return _judge(case, positions, *_nearest_vertices(case, positions))
