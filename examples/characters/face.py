# SPDX-License-Identifier: GPL-3.0-or-later
"""Suzanne with expressions, sculpted by this script with brushes of smooth falloff.

Lengths are in Suzanne's unit (her head is two wide); x to her left, y backwards, z up. Her eyes are
loose parts.
"""

import numpy as np

from characters.character import Character, Handle, Key, Look, ball, disjoint

EYE = np.array([0.3529, -0.8, 0.2442])
MOUTH = np.array([0.0, -0.71, -0.8])


def smooth(value, low, high):
    """0 below low, 1 above high, twice differentiable between."""
    t = np.clip((np.asarray(value) - low) / (high - low), 0.0, 1.0)
    return t**3 * (10.0 - 15.0 * t + 6.0 * t**2)


def brush(positions, centre, radii):
    """Falloff around a point: 1 there, 0 from the ellipsoid of those radii on."""
    return 1.0 - smooth(np.linalg.norm((positions - centre) / radii, axis=1), 0.0, 1.0)


def both(centre):
    """A point of her left side and its mirror image, each with its sign."""
    return (np.asarray(centre), 1.0), (np.asarray(centre) * [-1, 1, 1], -1.0)


class Sculpture:
    """Displacements are measured on the rest shape, so that strokes of one expression do not depend
    on their order.
    """

    def __init__(self, rest, is_eye):
        self.rest, self.is_eye = rest, is_eye
        self.moved = np.zeros_like(rest)

    def pull(self, centre, radii, offset, symmetric=True):
        """Drag what is around a point; the mirrored point along the mirrored way."""
        sides = both(centre) if symmetric else ((np.asarray(centre), 1.0),)
        for point, side in sides:
            share = brush(self.rest, point, np.asarray(radii)) * ~self.is_eye
            self.moved += share[:, None] * np.array([side, 1.0, 1.0]) * offset
        return self

    def inflate(self, normals, centre, radii, amount):
        for point, _ in both(centre):
            share = brush(self.rest, point, np.asarray(radii)) * ~self.is_eye
            self.moved += amount * share[:, None] * normals
        return self

    def swing(self, share, hinge, degrees):
        """Turn about an axis along x through `hinge`, each vertex by its share of the angle."""
        angle = np.radians(degrees) * share
        y, z = (self.rest - hinge).T[1:]
        self.moved[:, 1] += y * np.cos(angle) - z * np.sin(angle) - y
        self.moved[:, 2] += y * np.sin(angle) + z * np.cos(angle) - z
        return self

    def lids(self, side, upper, lower):
        """Draw the lids of one eye over the lens: the last stroke, for it has to end up over the
        lens.
        """
        x, z = side * self.rest[:, 0] - EYE[0], self.rest[:, 2] - EYE[2]
        arch = np.clip(1.0 - (x / 0.25) ** 2, 0.0, 1.0) ** 1.2
        near = smooth(-self.rest[:, 1], 0.55, 0.68) * (side * self.rest[:, 0] > 0.0) * ~self.is_eye
        rim = 0.157 * np.sqrt(np.clip(1.0 - (x / 0.26) ** 2, 0.0, 1.0))
        down = upper * arch * (1.0 - smooth(z, rim, rim + 0.2)) * smooth(z, -0.03, 0.05)
        up = lower * arch * (1.0 - smooth(-z, rim, rim + 0.2)) * smooth(-z, -0.03, 0.05)
        shift = near * (up - down)
        self.moved[:, 2] += shift
        bulge = np.where(down > up, -0.87, -0.86) + 2.2 * (x**2 + (z + self.moved[:, 2]) ** 2)
        cover = smooth(np.abs(shift), 0.0, 0.06)
        self.moved[:, 1] += cover * np.minimum(bulge - self.rest[:, 1], 0.0)
        return self

    def mouth(self, corners, wider):
        """Bend the mouth's line into an arc by how far its corners rise, and widen it."""
        x = self.rest[:, 0] / 0.2
        near = brush(self.rest, MOUTH, np.array([0.75, 0.5, 0.42])) * ~self.is_eye
        self.moved[:, 2] += corners * np.minimum(x**2, 2.0) * near
        self.moved[:, 0] += wider * np.tanh(x) * near
        self.moved[:, 1] += 0.35 * abs(wider) * np.minimum(x**2, 2.0) * near
        return self

    def shape(self):
        return self.rest + self.moved


def with_wider_mouth(positions):
    """Suzanne's mouth is a dimple; one to speak with is twice as wide."""
    share = brush(positions, MOUTH, np.array([0.34, 0.3, 0.26]))
    result = positions.copy()
    result[:, 0] += 1.1 * positions[:, 0] * share
    result[:, 2] += 0.04 * share
    return result


def jaw(positions):
    """How far a vertex belongs to the lower jaw: the lip fully, the muzzle's sides gradually."""
    x, y, z = positions.T
    lip = smooth(-z, 0.742, 0.83)
    side = smooth(-z, 0.5, 0.95)
    in_mouth = 1.0 - smooth(np.abs(x), 0.02, 0.3)
    in_front = smooth(-y, 0.5, 0.62)
    return side + (lip - side) * in_mouth * in_front


def normals_of(positions, quads):
    """Unit vertex normals."""
    a, b, c, d = positions[quads].transpose(1, 0, 2)
    across = np.cross(c - a, d - b)
    normals = np.zeros_like(positions)
    for corner in quads.T:
        np.add.at(normals, corner, across)
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)


def eyes_of(positions, quads):
    """Which vertices belong to the loose parts: all but the part that has most of them."""
    label = np.arange(len(positions))
    while True:
        lowest = label.copy()
        for corner in quads.T:
            np.minimum.at(lowest, corner, label[quads].min(axis=1))
        if np.array_equal(lowest, label):
            return label != np.bincount(label).argmax()
        label = lowest


def expressions(positions, normals, is_eye):
    """The Basis and the expressions, by name."""
    rest = with_wider_mouth(positions)
    rest[:, 1] += (
        0.04 * is_eye
    )  # lids go straight from open to shut: on the way they clear the eyes

    def clay():
        return Sculpture(rest, is_eye)

    corner, lower_lip, cheek = (0.21, -0.68, -0.78), (0.0, -0.68, -0.87), (0.4, -0.55, -0.1)
    brow_in, brow_out, brow_mid = (0.16, -0.75, 0.55), (0.66, -0.6, 0.42), (0.36, -0.77, 0.62)
    shapes = {"Basis": rest}

    smile = clay().mouth(0.13, 0.12).pull(cheek, (0.36, 0.4, 0.32), (0.06, -0.12, 0.1))
    smile.pull(lower_lip, (0.2, 0.2, 0.12), (0, 0.02, -0.03), symmetric=False)
    smile.pull(brow_mid, (0.4, 0.4, 0.3), (0, 0, 0.05))
    for side in (1, -1):
        smile.lids(side, 0.0, 0.07)
    shapes["Smile"] = smile.shape()

    frown = (
        clay()
        .mouth(-0.1, -0.02)
        .pull(lower_lip, (0.24, 0.2, 0.18), (0, -0.05, 0.03), symmetric=False)
    )
    frown.pull(brow_in, (0.36, 0.4, 0.34), (-0.05, -0.06, -0.12))
    frown.pull(brow_out, (0.3, 0.4, 0.3), (0.0, 0.0, 0.07))
    for side in (1, -1):
        frown.lids(side, 0.07, 0.03)
    shapes["Frown"] = frown.shape()

    opened = clay().swing(jaw(rest), np.array([0.0, 0.1, -0.45]), 26.0)
    opened.pull((0, -0.64, -0.79), (0.2, 0.14, 0.1), (0, 0.14, 0), symmetric=False)
    opened.pull(brow_mid, (0.45, 0.4, 0.32), (0, 0, 0.06))
    shapes["Jaw open"] = opened.shape()

    brows = (
        clay()
        .pull(brow_mid, (0.5, 0.5, 0.42), (0, 0.02, 0.2))
        .pull(brow_in, (0.26, 0.4, 0.3), (0, 0, 0.06))
    )
    for side in (1, -1):
        brows.lids(side, -0.05, -0.02)
    shapes["Brows up"] = brows.shape()

    for side, name in ((1, "Wink L"), (-1, "Wink R")):
        wink, flip = clay(), np.array([side, 1, 1])
        for point, radii, way in (
            (brow_mid, (0.36, 0.4, 0.3), (0, 0, -0.09)),
            (cheek, (0.36, 0.4, 0.3), (0.02, -0.08, 0.12)),
            (corner, (0.3, 0.34, 0.34), (0.1, 0.06, 0.1)),
        ):
            wink.pull(np.array(point) * flip, radii, np.array(way) * flip, symmetric=False)
        shapes[name] = wink.lids(side, 0.2, 0.12).shape()

    puff = clay().inflate(normals, (0.26, -0.5, -0.55), (0.3, 0.42, 0.42), 0.2)
    puff.mouth(0.0, -0.09).pull(MOUTH, (0.3, 0.3, 0.26), (0, -0.08, 0.0), symmetric=False)
    puff.pull(brow_mid, (0.45, 0.4, 0.32), (0, 0, -0.04))
    shapes["Puff"] = puff.shape()
    return shapes


SKIN, MUZZLE, EYEBALL = (
    np.array([0.46, 0.26, 0.16]),
    np.array([0.9, 0.68, 0.5]),
    np.array([0.97, 0.97, 0.95]),
)
DARK, LIP = np.array([0.05, 0.035, 0.03]), np.array([0.5, 0.14, 0.13])


def rim_of(quads, is_eye):
    """The vertices around the openings of the eyes: the boundary of the head."""
    start, end = quads.ravel(), np.roll(quads, -1, axis=1).ravel()
    edges = np.sort(np.stack([start, end], axis=1), axis=1)
    edges, uses = np.unique(edges, axis=0, return_counts=True)
    rim = np.unique(edges[uses == 1])
    return rim[~is_eye[rim]]


def colours(positions, quads, is_eye):
    """Fur, a pale face, eyes with irises and the inside of the mouth, from the rest positions."""
    x, y, z = positions.T
    face = (
        smooth(-y, 0.42, 0.56)
        * (1.0 - smooth(np.hypot(x * 0.9, z - 0.15), 0.66, 0.74))
        * (1.0 - smooth(z, 0.5, 0.62))
    )
    muzzle = smooth(-y, 0.3, 0.36) * (1.0 - smooth(z, -0.2, -0.14))
    ears = (1.0 - smooth(np.abs(np.abs(x) - 1.1), 0.14, 0.2)) * smooth(np.abs(x), 0.9, 0.98)
    colour = SKIN + np.maximum(np.maximum(face, muzzle), 0.6 * ears)[:, None] * (MUZZLE - SKIN)
    nose = brush(positions, np.array([0, -0.8, -0.22]), np.array([0.2, 0.1, 0.12])) > 0.05
    colour[nose] = DARK
    inside = smooth(y, -0.7, -0.66) * smooth(0.075 - np.abs(z + 0.785), 0.0, 0.03)
    inside *= 1.0 - smooth(np.abs(x), 0.2, 0.24)
    colour += inside[:, None] * (LIP - colour)
    rim = positions[rim_of(quads, is_eye)]
    from_rim = np.array([np.linalg.norm(rim - p, axis=1).min() for p in positions])
    colour += (1.0 - smooth(from_rim, 0.006, 0.022))[:, None] * (DARK - colour)
    iris = 1.0 - smooth(np.hypot(np.abs(x) - EYE[0], z - EYE[2]), 0.096, 0.108)[:, None]
    return np.where(is_eye[:, None], EYEBALL + iris * (DARK - EYEBALL), colour)


TITLE = "Suzanne and what her seven expressions make of a few dragged handles"
LOOK = Look(heading=12.0, height=4.0, centre=(0.0, 0.0, -0.24), width=2.95, aspect=1.1)
KEYS = [
    Key(1, "Basis"),
    Key(8, "Brows up"),
    Key(15, "Smile"),
    Key(21, "Wink L", others={"corner": ("Smile", 1.0)}, note="Wink L + Smile"),
    Key(29, "Frown"),
    Key(36, "Jaw open", others={"brow": ("Frown", 1.0), "lid": ("Frown", 1.0)}, note="Jaw + Frown"),
    Key(43, "Jaw open", 1.25, note="Jaw open, beyond"),
    Key(51, "Puff"),
    Key(60, "Basis"),
]
STRIP = (1, 5, 8, 12, 15, 18, 21, 25, 29, 33, 36, 40, 43, 47, 51, 56)


def handles(positions, is_eye):
    """The eyes are loose parts, which need a handle to hold them: they ride with the skull."""
    x, y, z = positions.T
    skin = ~is_eye
    result = [
        Handle("skull", "ORIENTED", np.flatnonzero(is_eye | (y > 0.1))),
        Handle("nose", "PINNED", ball(positions, (0, -0.8, -0.22), 0.1, skin)),
        Handle("chin", "PINNED", ball(positions, (0, -0.64, -0.95), 0.1, skin)),
    ]
    for side, sign in (("L", 1.0), ("R", -1.0)):
        flip = np.array([sign, 1.0, 1.0])
        for name, kind, place, radius in (
            ("corner", "PINNED", (0.23, -0.68, -0.78), 0.06),
            ("brow", "PINNED", (0.3, -0.75, 0.67), 0.08),
            ("temple", "PINNED", (0.68, -0.55, 0.42), 0.09),
            ("lid", "PINNED", (0.353, -0.755, 0.42), 0.05),
            ("jowl", "PINNED", (0.3, -0.5, -0.5), 0.09),
            ("cheek", "FREE", (0.42, -0.58, -0.1), 0.09),
        ):
            vertices = ball(positions, np.array(place) * flip, radius, skin)
            result.append(Handle(f"{name}.{side}", kind, vertices))
    return disjoint(result)


def build():
    positions, quads = suzanne()
    is_eye = eyes_of(positions, quads)
    shapes = expressions(positions, normals_of(positions, quads), is_eye)
    return Character(
        name="face",
        faces=quads,
        shapes=shapes,
        colours=colours(shapes["Basis"], quads, is_eye),
        handles=handles(shapes["Basis"], is_eye),
        keys=KEYS,
        rotations=False,
        title=TITLE,
        strip=STRIP,
        look=LOOK,
    )


def suzanne(levels=2):
    """Blender's own monkey, subdivided: positions [V][3] and quads [Q][4]."""
    import bpy

    bpy.ops.mesh.primitive_monkey_add(size=2.0)
    original = bpy.context.object
    original.modifiers.new("Subdivision", "SUBSURF").levels = levels
    evaluated = original.evaluated_get(bpy.context.evaluated_depsgraph_get())
    mesh = bpy.data.meshes.new_from_object(evaluated)
    positions = np.empty(3 * len(mesh.vertices))
    quads = np.empty(4 * len(mesh.polygons), dtype=int)
    mesh.vertices.foreach_get("co", positions)
    mesh.polygons.foreach_get("vertices", quads)
    bpy.data.objects.remove(original)
    bpy.data.meshes.remove(mesh)
    return positions.reshape(-1, 3), quads.reshape(-1, 4)
