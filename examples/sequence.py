# SPDX-License-Identifier: GPL-3.0-or-later
"""A walk, captured and edited as time, pose and shape, with the add-on:

    blender -b --factory-startup --addons exemplar --python sequence.py -- FOLDER

Captures a walk of three cycles; plays one of them again, with a step that its curve in the pose
plane makes higher; retimes it; puts it on another character; draws an animation from nothing;
bakes. Measures at every step, leaves a .blend file and pictures. Exit code 1 if anything is not as
it should be.
"""

import math
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from characters import gait  # noqa: E402
from characters.creature import LOOK  # noqa: E402
from pc2 import read_pc2  # noqa: E402
from perform import frame_view, make_mesh_object, run  # noqa: E402
from pose_plane import draw_plane  # noqa: E402
from studio import Strip  # noqa: E402

TILES = 8


# ------------------------------------------------------------------------------------- the scene


def animate(walker, poses):
    """The walk as a mesh that one shape key a frame moves: to a capture, any animation is alike."""
    obj = make_mesh_object("creature", walker.positions, walker.faces, walker.colours)
    obj.shape_key_add(name="Basis", from_mix=False)
    keys = []
    for frame, pose in enumerate(poses, start=1):
        key = obj.shape_key_add(name=f"Frame {frame:02d}", from_mix=False)
        key.data.foreach_set("co", walker.posed(pose).astype(np.float32).ravel())
        keys.append(key)
    for frame, key in enumerate(keys, start=1):
        for near, value in ((frame - 1, 0.0), (frame, 1.0), (frame + 1, 0.0)):
            key.value = value
            key.keyframe_insert("value", frame=near)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = 1, len(poses)
    scene.frame_set(1)
    return obj


def with_matched_poses(name, walker):
    obj = make_mesh_object(name, walker.positions, walker.faces, walker.colours)
    for key_name, shape in walker.matched().items():
        key = obj.shape_key_add(name=key_name, from_mix=False)
        key.data.foreach_set("co", shape.astype(np.float32).ravel())
    return obj


def activate(*objects):
    for obj in bpy.context.view_layer.objects:
        obj.select_set(obj in objects)
    bpy.context.view_layer.objects.active = objects[0]


def shown(obj, frames):
    """float32 [n][V][3]: what Blender shows."""
    found = []
    for frame in frames:
        whole = math.floor(frame)
        bpy.context.scene.frame_set(whole, subframe=frame - whole)
        mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
        positions = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.vertices.foreach_get("co", positions)
        found.append(positions.reshape(-1, 3))
    return np.stack(found)


def share(difference, diagonal):
    """RMS distance of vertices as a share of the diagonal."""
    return float(np.sqrt((difference.astype(float) ** 2).sum(axis=-1).mean()) / diagonal)


# ----------------------------------------------------------------------------------- what is done


def capture(obj, poses, walker):
    activate(obj)
    began = time.perf_counter()
    run(bpy.ops.exemplar.sequence_capture, tolerance=0.1)
    seconds = time.perf_counter() - began
    owner = bpy.context.view_layer.objects.active
    print(f"   captured: {owner.exemplar_sequence.summary} ({seconds:.1f} s)")
    truth = np.stack([walker.posed(pose) for pose in poses])
    diagonal = float(np.linalg.norm(np.ptp(truth[0], axis=0)))
    error = share(shown(owner, range(1, len(poses) + 1)) - truth, diagonal)
    halves = [i + 0.5 for i in range(1, len(poses))]
    between = np.stack(
        [
            walker.posed(
                gait.walk_pose((t - 1) / gait.CYCLE, 0.7 + 0.9 * (t - 1) / (len(poses) - 1))
            )
            for t in halves
        ]
    )
    found = share(shown(owner, halves) - between, diagonal)
    straight = share((truth[:-1] + truth[1:]) / 2 - between, diagonal)
    print(f"   frames are off by {error:.2e} of the diagonal")
    print(f"   half-way between frames by {found:.2e}; straight lines by {straight:.2e}")
    require(error < 1.5e-3, "the frames come back")
    return owner


def edit(owner, count):
    """Loop the second cycle, then lift what is played again: two control points move away."""
    before = shown(owner, range(1, count + 1))
    activate(owner)
    run(bpy.ops.exemplar.sequence_loop, start=17, end=33, count=1)
    longer = sequence(owner).info.frame_count
    kept = np.abs(shown(owner, range(1, 15)) - before[:14]).max()
    print(f"   looped: {count} frames became {longer}; the first 14 differ by {kept:.1e}")
    require(kept < 1e-6, "a loop leaves what is before it alone")
    bpy.context.scene.frame_end = longer
    looped = shown(owner, range(1, longer + 1))
    curve = owner.exemplar_sequence.curve
    middle = len(curve.data.vertices) // 2
    centre = np.mean([vertex.co[:2] for vertex in curve.data.vertices], axis=0)
    for index in (middle, middle + 1):
        place = np.array(curve.data.vertices[index].co[:2])
        curve.data.vertices[index].co[:2] = (centre + 1.6 * (place - centre)).tolist()
    curve.data.update()
    bpy.context.view_layer.update()
    edited = shown(owner, range(1, longer + 1))
    changed = np.flatnonzero((edited != looped).any(axis=(1, 2))) + 1
    first, last = changed[0], changed[-1]
    print(f"   two control points moved: frames {first} to {last} changed, the others not a bit")
    require(0 < len(changed) < 0.4 * longer, "an edit is local")
    return edited, range(first, last + 1)


def retime(owner, frames):
    """The steps that were lifted in slow motion, by keyframes of the time."""
    activate(owner)
    data, scene = owner.exemplar_sequence, bpy.context.scene
    first, last, end = frames[0], frames[-1], scene.frame_end
    slow = last - first
    for frame, value in ((first, first), (last + slow, last), (end + slow, end)):
        data.time = value
        owner.keyframe_insert("exemplar_sequence.time", frame=frame)
    for point in time_curve(owner).keyframe_points:
        point.interpolation = "LINEAR"
    scene.frame_end = end + slow
    at = range(first, last + slow + 1)
    expected = np.stack([sequence(owner).evaluate(first - 1 + (f - first) / 2) for f in at])
    worst = np.abs(shown(owner, at) - expected).max()
    print(f"   slow motion: frames {first} to {last} take {len(at)} frames; off by {worst:.1e}")
    require(worst < 1e-4, "the time's curve says when")


def transfer(owner, examples, target):
    chosen = bpy.context.scene.exemplar_transfer
    chosen.examples, chosen.target = examples, target
    activate(owner)
    run(bpy.ops.exemplar.sequence_transfer)
    made = bpy.context.view_layer.objects.active
    print(f"   transferred: {len(made.data.vertices)} vertices, {made.exemplar_sequence.summary}")
    return made


def check_transfer(made, walker, poses):
    """The first cycles are those of the walk: as the other character would have walked itself."""
    diagonal = float(np.linalg.norm(np.ptp(walker.positions, axis=0)))
    truth = np.stack([walker.posed(pose) for pose in poses[:14]])
    found = shown(made, range(1, 15))
    error, moved = share(found - truth, diagonal), share(truth - walker.positions, diagonal)
    print(f"   off by {error:.2e} of the diagonal from a walk of its own, which moves {moved:.2e}")
    require(error < 0.25 * moved, "the other character walks alike")


def bake(made, folder):
    activate(made)
    path = folder / "sequence.pc2"
    scene = bpy.context.scene
    frames = range(scene.frame_start, scene.frame_end + 1)
    expected = shown(made, frames)
    run(bpy.ops.exemplar.bake, format="PC2", filepath=str(path))
    _, baked = read_pc2(path)
    worst = np.abs(baked - expected).max()
    print(f"   baked: {path.name}, differs from what was seen by {worst:.1e}")
    require(worst == 0.0, "a bake is what was seen")
    run(bpy.ops.exemplar.bake_remove)


def draw_from_nothing(walker):
    """Poses placed in a plane, and a circle drawn through them: a walk that nobody has animated."""
    obj = with_matched_poses("poses", walker)
    activate(obj)
    run(bpy.ops.exemplar.sequence_from_keys, frame_count=33)
    owner = bpy.context.view_layer.objects.active
    frames = shown(owner, range(1, 34))
    steps = np.abs(np.diff(frames, axis=0)).max(axis=(1, 2))
    print(f"   from nothing: 17 poses, 33 frames, {steps.max():.2f} at most from one to the next")
    require(steps.min() > 0, "it moves")
    return owner


# --------------------------------------------------------------------------------------- pictures


def strip(folder, name, title, walker, rows):
    picture = Strip(LOOK, walker.faces, walker.colours, min(TILES, len(rows[0][1])))
    for label, frames, positions in rows:
        chosen = np.unique(np.linspace(0, len(frames) - 1, TILES).round().astype(int))
        for index in chosen:
            strong = index == chosen[0]
            words = f"{label} {frames[index]}" if strong else str(frames[index])
            picture.add(positions[index], words, strong)
    picture.render(folder / f"{name}.png", 240, title)


def sequence(owner):
    from exemplar.scene.sequences import store

    return store.ensure(owner).sequence


def time_curve(owner):
    from exemplar.scene.sequences import retiming

    return retiming.curve_of(owner)


def require(holds, what):
    if not holds:
        raise RuntimeError(f"not so: {what}")


def main(folder):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    began = time.perf_counter()
    creature, cousin = gait.creature(), gait.cousin()
    poses = gait.walk()
    print(
        f"   modelled: {len(creature.positions)} and {len(cousin.positions)} vertices, "
        f"{len(poses)} frames ({time.perf_counter() - began:.1f} s)"
    )
    owner = capture(animate(creature, poses), poses, creature)
    captured = shown(owner, range(1, len(poses) + 1))
    draw_plane(owner, LOOK, creature.colours, folder / "sequence_plane.png")
    edited, changed = edit(owner, len(poses))
    examples = with_matched_poses("creature poses", creature)
    target = with_matched_poses("cousin", cousin)
    made = transfer(owner, examples, target)
    check_transfer(made, cousin, poses)
    carried = shown(made, changed)
    bake(made, folder)
    retime(owner, changed)
    frame_view(LOOK)
    examples.hide_set(True)
    made.location.x = 3.0
    bpy.ops.wm.save_as_mainfile(filepath=str(folder / "sequence.blend"), check_existing=False)
    rows = [
        ("captured", list(changed), captured[[min(f, len(captured)) - 1 for f in changed]]),
        ("edited", list(changed), edited[[frame - 1 for frame in changed]]),
    ]
    strip(folder, "sequence", "A walk, and steps that its curve makes higher", creature, rows)
    strip(
        folder,
        "sequence_transfer",
        "The same on another character",
        cousin,
        [("carried", list(changed), carried)],
    )
    draw_from_nothing(creature)


if __name__ == "__main__":
    try:
        main(Path(sys.argv[sys.argv.index("--") + 1]).resolve())
    except Exception:
        traceback.print_exc()
        sys.exit(1)
