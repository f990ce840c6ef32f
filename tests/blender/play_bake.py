# SPDX-License-Identifier: GPL-3.0-or-later
"""Run by test_bake.py in a Blender without the add-on: does a baked file play what was solved?

    blender -b --factory-startup baked.blend --python play_bake.py -- OBJECT expected.npz

expected.npz  frames [N], positions [N][V][3]
Prints one line of JSON: the largest differences on the frames and half way between them.
"""

import json
import sys

import bpy
import numpy as np


def positions(obj):
    depsgraph = bpy.context.evaluated_depsgraph_get()
    mesh = obj.evaluated_get(depsgraph).data
    found = np.empty((len(mesh.vertices), 3), np.float32)
    mesh.vertices.foreach_get("co", found.ravel())
    return found


def main(name, path):
    assert not hasattr(bpy.types.Object, "exemplar"), "the add-on is there"
    expected = np.load(path)
    frames, samples = expected["frames"].tolist(), expected["positions"]
    obj, scene = bpy.data.objects[name], bpy.context.scene
    on, between = 0.0, 0.0
    # Out of order: a player has no memory.
    for index in [*range(0, len(frames), 2), *range(1, len(frames), 2)]:
        scene.frame_set(frames[index])
        on = max(on, float(np.abs(positions(obj) - samples[index]).max()))
    for index in range(len(frames) - 1):
        middle = 0.5 * (frames[index] + frames[index + 1])
        scene.frame_set(int(middle), subframe=middle - int(middle))
        half_way = 0.5 * (samples[index] + samples[index + 1])
        between = max(between, float(np.abs(positions(obj) - half_way).max()))
    print("RESULT " + json.dumps({"on": on, "between": between, "vertices": len(samples[0])}))


main(*sys.argv[sys.argv.index("--") + 1 :])  # noqa: E203
