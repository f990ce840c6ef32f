# SPDX-License-Identifier: GPL-3.0-or-later
"""The creature by the other two deformers: Rigidity, soft, painted and learned; and Blended.

    blender -b --factory-startup --addons exemplar --python deformers.py -- FOLDER

The same handles do the same as in perform.py. Each performance is baked and compared with stateless
solves, and all of them are drawn beside each other. Exit code 1 if anything is not as it should be.
"""

import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from characters.character import modelled  # noqa: E402
from perform import (  # noqa: E402
    TOLERANCE,
    add_handles,
    check,
    frame_view,
    keyframe,
    make_object,
    run,
)
from playback import dots_of_empties  # noqa: E402
from studio import Strip  # noqa: E402

FRAMES = (7, 13, 20, 27, 33)
LAST = 34  # of the creature's 60 frames
SOFT, STIFF = 0.0, 1.0


def uniform(obj, _character):
    obj.exemplar.rigidity.source = "UNIFORM"
    obj.exemplar.rigidity.radius = 1


def painted(obj, character):
    """Head, chest and hips like bone, the belly and the tail like rubber: with the paint bucket."""
    positions = character.shapes["Basis"]
    fill(obj, np.arange(len(positions)), 0.2)
    for handle in character.handles:
        if handle.name in ("head", "hips", "chest"):
            near = distance_to(positions, handle) < (0.15 if handle.name == "head" else 0.35)
            fill(obj, np.flatnonzero(near), STIFF)
        if handle.name.startswith("tail") or handle.name == "belly":
            fill(obj, np.flatnonzero(distance_to(positions, handle) < 0.3), SOFT)


def distance_to(positions, handle):
    centre = positions[handle.vertices].mean(axis=0)
    reach = np.linalg.norm(positions[handle.vertices] - centre, axis=1).max()
    return np.linalg.norm(positions - centre, axis=1) - reach


def fill(obj, vertices, value):
    chosen = np.zeros(len(obj.data.vertices), dtype=bool)
    chosen[vertices] = True
    obj.data.vertices.foreach_set("select", chosen)
    run(bpy.ops.exemplar.rigidity_fill, value=value)


def learned(obj, _character):
    obj.exemplar.rigidity.omega = 0.03  # the mesh is fine: six of its rings are a small place
    began = time.perf_counter()
    run(bpy.ops.exemplar.rigidity_learn_keys)
    print(f"      learned from the exemplars ({time.perf_counter() - began:.1f} s)")


def blended(obj, _character):
    obj.exemplar.deformer = "BLENDED"


PERFORMANCES = (
    ("rigidity_soft", "Rigidity, one ring", "RIGIDITY", uniform),
    ("rigidity_painted", "Rigidity, painted", "RIGIDITY", painted),
    ("rigidity_learned", "Rigidity, learned", "RIGIDITY", learned),
    ("blended", "Blended", "BLENDED", blended),
)


def perform(obj, character, name, folder):
    """All frames as baked, {frame: float32 [V][3]}."""
    from exemplar.scene.baking import pc2

    began = time.perf_counter()
    run(bpy.ops.exemplar.rebind if obj.exemplar.bound else bpy.ops.exemplar.bind)
    bound = time.perf_counter() - began
    path = folder / f"creature_{name}.pc2"
    began = time.perf_counter()
    # Without a modifier, which would hide what the next deformer does.
    options = {"format": "PC2", "filepath": str(path), "use_modifier": False, "stop_live": False}
    run(bpy.ops.exemplar.bake, **options)
    baked = time.perf_counter() - began
    print(f"   {name}: bound in {bound:.2f} s, baked in {baked:.1f} s")
    worst = check(obj, path)
    print(f"   bake against stateless solves: {worst:.1e} of the diagonal (allowed {TOLERANCE:g})")
    if worst > TOLERANCE:
        raise RuntimeError("the bake differs from the stateless solves")
    header, samples = pc2.read(str(path))
    return {int(header.start) + index: sample for index, sample in enumerate(samples)}


def stiffness_colours(obj):
    """Blue is soft, red is stiff: float32 [V][3]."""
    from exemplar.scene import stiffness
    from exemplar.ui.heat import ramp

    return ramp(stiffness.shares(obj))[:, :3]


def draw(character, faces, rows, folder):
    strip = Strip(character.look, faces, character.colours, 1 + len(FRAMES))
    for label, colours, frames in rows:
        strip.add(character.shapes["Basis"], label, True, colours=colours)
        for frame in FRAMES:
            dots = dots_of_empties(character.handles, frame)
            strip.add(frames[frame], str(frame), False, dots)
    title = "One performance, four materials: blue is soft, red is stiff"
    strip.render(folder / "creature_deformers.png", 300, title)


def main(folder):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    character = modelled("creature", folder)
    obj = make_object(character)
    add_handles(obj, character)
    keyframe(obj, character)
    bpy.context.scene.frame_end = LAST
    faces = np.array([polygon.vertices[:] for polygon in obj.data.polygons])
    rows = []
    for name, label, deformer, prepare in PERFORMANCES:
        bpy.context.scene.frame_set(1)
        obj.exemplar.deformer = deformer
        prepare(obj, character)
        frames = perform(obj, character, name, folder)
        colours = stiffness_colours(obj) if deformer == "RIGIDITY" else None
        rows.append((label, colours, frames))
    draw(character, faces, rows, folder)
    frame_view(character.look)
    bpy.ops.wm.save_as_mainfile(
        filepath=str(folder / "creature_deformers.blend"), check_existing=False
    )


if __name__ == "__main__":
    try:
        main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
    except Exception:
        traceback.print_exc()
        sys.exit(1)
