#!/usr/bin/python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Stiffness learned from poses, drawn as Chen et al. do: blue is r = 1, red is r = 6.

For each set of poses (an .npz with `poses` [n][V][3], the reference first, and `faces` [F][3]) and
each omega it draws the reference from the side, and prints how many vertices have which radius.
Needs numpy and the library, not Blender.

    examples/learned_radii.py FOLDER POSES.npz ... [--omega 0.3 0.03]
"""

import argparse
import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(HERE.parent / "blender_addon")]

import native  # noqa: E402
from drawing import Page  # noqa: E402

COLOURS = np.array(
    [
        [0.15, 0.25, 0.75],
        [0.15, 0.60, 0.85],
        [0.25, 0.75, 0.45],
        [0.90, 0.85, 0.25],
        [0.95, 0.55, 0.15],
        [0.80, 0.15, 0.15],
    ]
)
WIDTH, MARGIN = 420, 20


def load(path):
    with np.load(path) as arrays:
        return arrays["poses"].astype(np.float32), arrays["faces"].astype(np.uint32)


def view(points):
    """From the side: the longest extent to the right, the second up, looking along the shortest."""
    order = np.argsort(np.ptp(points, axis=0))
    right, away = points[:, order[2]], points[:, order[0]]
    up = points[:, order[1]]
    return np.stack([right, up, away], axis=1)


def draw(page, left, top, points, faces, radii):
    seen = view(points)
    low, span = seen.min(axis=0), np.ptp(seen, axis=0)
    scale = (WIDTH - 2 * MARGIN) / span[:2].max()
    flat = np.stack(
        [
            left + MARGIN + scale * (seen[:, 0] - low[0]),
            top + MARGIN + scale * (low[1] + span[1] - seen[:, 1]),
        ],
        axis=1,
    )
    corners = seen[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    light = np.abs(normals[:, 2]) / np.maximum(np.linalg.norm(normals, axis=1), 1e-20)
    colours = COLOURS[radii[faces] - 1].mean(axis=1) * (0.45 + 0.55 * light[:, None])
    for face in np.argsort(corners[:, :, 2].mean(axis=1)):
        page.polygon(flat[faces[face]], colours[face])


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("poses", type=Path, nargs="+")
    parser.add_argument("--omega", type=float, nargs="+", default=[0.3, 0.03])
    arguments = parser.parse_args()
    for path in arguments.poses:
        poses, faces = load(path)
        mesh = native.Mesh(poses[0], faces)
        page = Page(WIDTH * len(arguments.omega), WIDTH)
        for column, omega in enumerate(arguments.omega):
            radii = native.learn_radii(mesh, poses[1:], omega=omega)
            draw(page, column * WIDTH, 10, poses[0], faces, radii)
            page.text((column * WIDTH + MARGIN, 20), f"{path.stem}, omega {omega:g}")
            counts = np.bincount(radii, minlength=7)[1:]
            print(f"{path.stem}, omega {omega:g}: vertices of r = 1 to 6:", *counts)
        page.write_svg(arguments.folder / f"radii_{path.stem}.svg")
        page.write_png(arguments.folder / f"radii_{path.stem}.png", scale=1)


if __name__ == "__main__":
    main()
