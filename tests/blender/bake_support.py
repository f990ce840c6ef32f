# SPDX-License-Identifier: GPL-3.0-or-later
"""What the tests of baking share: a bound bar, and what a bake may and may not change."""

import contextlib
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
COMMAND_LINE = ROOT / "blender_addon" / "command_line.py"


def load_addon():
    """A function that imports modules of the add-on of this source tree."""
    if str(COMMAND_LINE.parent) not in sys.path:
        sys.path.append(str(COMMAND_LINE.parent))
    import command_line

    return command_line.load_addon()


@contextlib.contextmanager
def without_root():
    """Root may write anywhere; nobody may not."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


def random_bounded_problem(random, trial):
    """(matrix, right, lower, upper, start): tall and wide, equal and empty columns, shut bounds."""
    columns, rows = random.integers(1, 30), random.integers(1, 90)
    matrix = random.normal(size=(rows, columns))
    if trial % 5 == 0:
        matrix[:, columns // 2] = matrix[:, 0]
    if trial % 7 == 0 and columns > 1:
        matrix[:, -1] = 0.0
    lower = random.uniform(-1.0, 0.0, columns)
    upper = lower + random.uniform(0.0, 1.5, columns) * (random.random(columns) > 0.1)
    right = matrix @ random.uniform(-1.5, 1.5, columns) + 0.1 * random.normal(size=rows)
    start = random.uniform(-2.0, 2.0, columns) if trial % 3 == 0 else None
    return matrix, right, lower, upper, start


def blender(*arguments, env=None, prefix=()):
    """Run another Blender, background and factory settings; returns the finished process."""
    import bpy

    command = [*prefix, bpy.app.binary_path, "-b", *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=env, timeout=300)


def evaluated_positions(obj, depsgraph):
    """float32 [V][3], after modifiers."""
    mesh = obj.evaluated_get(depsgraph).data
    positions = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", positions.ravel())
    return positions


# ------------------------------------------------------------------------------------------- scene

HANDLES = ("Bottom", "Middle", "Top")
FIRST, LAST = 1, 12


def make_bar(addon, name="Bar"):
    """A bound bar with three poses beside its Basis, whose three handles are keyframed over FIRST
    to LAST."""
    import bpy

    bar = _bar_object(bpy, name)
    _add_poses(bar)
    _add_handles(bpy, bar)
    bpy.context.view_layer.update()
    bind(addon, bar)
    _animate(bar)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = FIRST, LAST
    scene.frame_set(FIRST)
    return bar


def bind(addon, obj):
    setup = addon("scene.setup")
    gathered = setup.prepare(obj)
    deformer, warnings = addon("scene.bindings").build(gathered)
    setup.commit(obj, gathered, deformer, warnings)


def _bar_object(bpy, name, rings=13, corners=10):
    angle = np.arange(corners) * 2 * np.pi / corners
    ring = np.column_stack([0.3 * np.cos(angle), 0.3 * np.sin(angle)])
    vertices = [(x, y, 0.2 * level) for level in range(rings) for x, y in ring]
    faces = [
        (
            level * corners + corner,
            level * corners + (corner + 1) % corners,
            (level + 1) * corners + (corner + 1) % corners,
            (level + 1) * corners + corner,
        )
        for level in range(rings - 1)
        for corner in range(corners)
    ]
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(vertices, [], faces)
    bar = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(bar)
    bpy.context.view_layer.objects.active = bar
    bar.location, bar.rotation_euler = (0.5, -1.0, 0.25), (0.1, 0.2, 0.3)
    return bar


def _add_poses(bar):
    bar.shape_key_add(name="Basis", from_mix=False)
    rest = np.array([vertex.co for vertex in bar.data.vertices])
    x, y, z = rest.T
    bend = 0.6 * z
    poses = {
        "Bend": np.column_stack(
            [x * np.cos(bend) + (1 - np.cos(bend)) / 0.6, y, (1 / 0.6 - x) * np.sin(bend)]
        ),
        "Fat": np.column_stack([x * (1 + np.sin(z)), y * (1 + np.sin(z)), 0.9 * z]),
        "Twist": np.column_stack(
            [x * np.cos(z) - y * np.sin(z), x * np.sin(z) + y * np.cos(z), 1.1 * z]
        ),
    }
    for name, positions in poses.items():
        key = bar.shape_key_add(name=name, from_mix=False)
        key.value = 0.0  # Blender 5 begins at 1
        key.data.foreach_set("co", positions.astype(np.float32).ravel())


def _add_handles(bpy, bar, corners=10):
    count = len(bar.data.vertices)
    starts = (0, count // 2 // corners * corners, count - corners)
    for name, start in zip(HANDLES, starts):
        vertices = list(range(start, start + corners))
        bar.vertex_groups.new(name=name).add(vertices, 1.0, "REPLACE")
        empty = bpy.data.objects.new(f"{bar.name} {name}", None)
        bpy.context.collection.objects.link(empty)
        item = bar.exemplar.handles.add()
        item.empty, item.group = empty, name


def _animate(bar):
    for number, item in enumerate(bar.exemplar.handles):
        empty = item.empty
        rest = empty.location.copy()
        for frame in range(FIRST, LAST + 1, 3):
            turn = 0.5 * frame + number
            empty.location = rest
            empty.location.x += 0.35 * number * np.sin(turn)
            empty.location.z += 0.15 * number * np.cos(turn)
            empty.keyframe_insert("location", frame=frame)


def solved(addon, bar, frames):
    """{frame: float32 [V][3]}: what every bake has to play."""
    import bpy

    scene = bpy.context.scene
    current = scene.frame_current
    positions = {}
    for frame in frames:
        scene.frame_set(frame)
        found = addon("scene.solving").solve(bar, bpy.context.evaluated_depsgraph_get())
        positions[frame] = found.positions.copy()
    scene.frame_set(current)
    return positions


def artists_data(obj):
    """What no bake may change: every key's coordinates, but for ours, and the mesh's own."""
    data = {"": _coordinates(obj.data.vertices)}
    for block in obj.data.shape_keys.key_blocks:
        if not block.name.startswith("Exemplar "):
            data[block.name] = _coordinates(block.data)
    return data


def _coordinates(items):
    values = np.empty(3 * len(items), np.float32)
    items.foreach_get("co", values)
    return values.tobytes()


def scene_state(obj):
    """Everything of an object that a bake could change, to compare."""
    import bpy

    key = obj.data.shape_keys
    action = key.animation_data.action if key.animation_data else None
    return {
        "keys": [(k.name, k.value, k.mute, k.relative_key.name) for k in key.key_blocks],
        "coordinates": artists_data(obj),
        "properties": sorted(key.keys()),
        "action": action and action.name,
        "curves": [
            (curve.data_path, [tuple(point.co) for point in curve.keyframe_points])
            for curve in (action.fcurves if action and hasattr(action, "fcurves") else ())
        ],
        "modifiers": [(modifier.name, modifier.type) for modifier in obj.modifiers],
        "live": obj.exemplar.live,
        "exemplars": [(item.name, item.enabled) for item in obj.exemplar.exemplars],
        "frame": (bpy.context.scene.frame_current, bpy.context.scene.frame_subframe),
        "actions": len(bpy.data.actions),
    }
