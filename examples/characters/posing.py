# SPDX-License-Identifier: GPL-3.0-or-later
"""Posing a mesh by curves through joints: limbs bend, stretch and squash, and keep their girth.

Each chain of joints is a curve sampled at nodes, each with a frame that turns as little as possible
along the curve. A vertex is carried by the nodes near it: by their mean position, their mean
*rotation* (so that nothing collapses at a bend, as it would with mean matrices) and their mean
girth.
"""

import numpy as np

NODES_PER_BONE = 6


def curve(joints, samples):
    """A centripetal Catmull-Rom curve through joints [J][3]: points [N][3] and unit tangents."""
    joints = np.asarray(joints, dtype=float)
    padded = np.vstack([2 * joints[0] - joints[1], joints, 2 * joints[-1] - joints[-2]])
    lengths = np.sqrt(np.maximum(np.linalg.norm(np.diff(padded, axis=0), axis=1), 1e-6))
    points, tangents = [], []
    for bone in range(len(joints) - 1):
        p = padded[bone : bone + 4]
        t = np.concatenate([[0.0], np.cumsum(lengths[bone : bone + 3])])
        last = bone == len(joints) - 2
        u = np.linspace(0.0, 1.0, samples + last, endpoint=last)
        x, dx = _cubic(p, t, u)
        points.append(x)
        tangents.append(dx)
    tangents = np.vstack(tangents)
    return np.vstack(points), tangents / np.linalg.norm(tangents, axis=1, keepdims=True)


def _cubic(p, t, u):
    """The Hermite cubic between p[1] and p[2], its slopes fit for unequal knots t, at u in 0..1."""
    span = t[2] - t[1]
    slope = []
    for i in (1, 2):
        before, after = t[i] - t[i - 1], t[i + 1] - t[i]
        left, right = (p[i] - p[i - 1]) / before, (p[i + 1] - p[i]) / after
        slope.append((left * after + right * before) / (before + after) * span)
    u = u[:, None]
    x = (
        (2 * u**3 - 3 * u**2 + 1) * p[1]
        + (u**3 - 2 * u**2 + u) * slope[0]
        + (3 * u**2 - 2 * u**3) * p[2]
        + (u**3 - u**2) * slope[1]
    )
    dx = (
        (6 * u**2 - 6 * u) * p[1]
        + (3 * u**2 - 4 * u + 1) * slope[0]
        + (6 * u - 6 * u**2) * p[2]
        + (3 * u**2 - 2 * u) * slope[1]
    )
    return x, dx


def turn(a, b):
    """The smallest rotation that takes unit vector a to b, as a quaternion (w, x, y, z)."""
    q = np.concatenate([[1.0 + a @ b], np.cross(a, b)])
    if q[0] < 1e-6:  # opposite: any perpendicular axis
        axis = np.cross(a, [1.0, 0.0, 0.0] if abs(a[0]) < 0.9 else [0.0, 1.0, 0.0])
        q = np.concatenate([[0.0], axis])
    return q / np.linalg.norm(q)


def about(axis, degrees):
    axis = np.asarray(axis, dtype=float)
    half = np.radians(degrees) / 2.0
    return np.concatenate([[np.cos(half)], np.sin(half) * axis / np.linalg.norm(axis)])


def multiply(a, b):
    """Quaternion products, broadcast over leading dimensions."""
    a, b = np.broadcast_arrays(a, b)
    scalar = a[..., :1] * b[..., :1] - np.sum(a[..., 1:] * b[..., 1:], axis=-1, keepdims=True)
    vector = a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])
    return np.concatenate([scalar, vector], axis=-1)


def rotate(q, v):
    """Rotate vectors v by unit quaternions q."""
    twice = 2.0 * np.cross(q[..., 1:], v)
    return v + q[..., :1] * twice + np.cross(q[..., 1:], twice)


def part(q, share):
    """That share of the rotation q, share 0..1 an array."""
    q = q if q[0] >= 0.0 else -q
    angle = np.arccos(min(q[0], 1.0)) * np.asarray(share)
    axis = q[1:] / max(np.linalg.norm(q[1:]), 1e-12)
    return np.concatenate([np.cos(angle)[..., None], np.sin(angle)[..., None] * axis], axis=-1)


def pose_chain(rest, posed, root, end, girth):
    """Positions [N][3], rotations [N][4] and girths [N] of the nodes along the curve through joints
    `posed`.

    root   quaternion of the chain's start
    end    quaternion of its last bone, or None: as the curve takes it
    girth  scale across the curve at each joint, on top of what keeps the volume where it stretches
    """
    a, before = curve(rest, NODES_PER_BONE)
    b, after = curve(posed, NODES_PER_BONE)
    rotations = [multiply(turn(rotate(root, before[0]), after[0]), root)]
    for i in range(1, len(a)):
        # Carry the frame along: undo the rest curve's turn, add the posed curve's.
        rotation = multiply(turn(after[i - 1], after[i]), rotations[-1])
        rotations.append(multiply(rotation, turn(before[i], before[i - 1])))
    rotations = np.array(rotations)
    along = np.linspace(0.0, 1.0, len(a))
    if end is not None:
        missing = multiply(end, rotations[-1] * [1.0, -1.0, -1.0, -1.0])
        share = np.clip(along * len(rest[1:]) / max(len(rest) - 2, 1), 0.0, 1.0)
        rotations = multiply(part(missing, share * share * (3.0 - 2.0 * share)), rotations)
    stretch = np.clip(_spacing(b) / _spacing(a), 0.4, 2.5)
    girth = np.interp(along, np.linspace(0.0, 1.0, len(girth)), girth)
    return b, rotations, girth * stretch**-0.5


def _spacing(points):
    """Distance between neighbouring nodes, averaged over five, so that girth changes slowly."""
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    spread = np.concatenate([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]])
    return np.convolve(np.pad(spread, 2, mode="edge"), np.full(5, 0.2), mode="valid")


def carry(positions, weights, rest, directions, posed):
    """Positions [V][3] carried by nodes with weights [V][N].

    rest        node positions [N][3]
    directions  unit tangents [N][3] of the rest curves: girth scales across them only
    posed       positions [N][3], rotations [N][4], girths [N]
    """
    target, rotations, girth = posed
    strongest = rotations[np.argmax(weights, axis=1)]
    sign = np.where(strongest @ rotations.T < 0.0, -1.0, 1.0)
    rotation = (weights * sign) @ rotations
    rotation /= np.linalg.norm(rotation, axis=1, keepdims=True)
    across = np.eye(3) - directions[:, :, None] * directions[:, None, :]
    scale = np.tensordot(weights, np.eye(3) + (girth - 1.0)[:, None, None] * across, axes=1)
    offset = np.einsum("vij,vj->vi", scale, positions - weights @ rest)
    return weights @ target + rotate(rotation, offset)
