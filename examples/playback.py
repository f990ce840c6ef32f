# SPDX-License-Identifier: GPL-3.0-or-later
"""Plays a bake in a Blender that has no add-on, compares with the file, and draws the strips.

    blender -b --factory-startup creature.blend --python playback.py -- creature FOLDER
"""

import sys
import traceback
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from characters.character import modelled  # noqa: E402
from pc2 import read_pc2  # noqa: E402
from studio import Strip  # noqa: E402


def played(obj):
    """The mesh as Blender shows it, float32 [V][3]."""
    mesh = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).data
    positions = np.empty(3 * len(mesh.vertices), np.float32)
    mesh.vertices.foreach_get("co", positions)
    return positions.reshape(-1, 3)


def play(obj, path):
    """All frames as played. Raises where they are not those of the file."""
    scene = bpy.context.scene
    start, baked = read_pc2(path)
    frames = {}
    for frame in range(scene.frame_start, scene.frame_end + 1):
        scene.frame_set(frame)
        frames[frame] = played(obj)
    worst = max(np.abs(shape - baked[f - int(start)]).max() for f, shape in frames.items())
    print(
        f"   played without the add-on: {len(frames)} frames, differ by {worst:.1e} from the file"
    )
    if worst > 0.0:
        raise RuntimeError("Blender does not play what the file holds")
    return frames


def dots_of_exemplar(shape, handles):
    """Where an exemplar has the handles."""
    return [(shape[handle.vertices].mean(axis=0), handle.kind) for handle in handles]


def dots_of_empties(handles, frame):
    """Where the empties are at a frame: what the mesh was asked to do."""
    bpy.context.scene.frame_set(frame)
    dots = []
    for handle in handles:
        if handle.kind != "FREE":
            world = bpy.data.objects[handle.name].matrix_world
            turn = np.array(world.to_3x3()) if handle.kind == "ORIENTED" else None
            dots.append((world.translation.copy(), handle.kind, turn))
    return dots


def draw(obj, character, frames, folder):
    mesh, look = obj.data, character.look
    faces = np.array([polygon.vertices[:] for polygon in mesh.polygons])
    colours = np.empty(4 * len(mesh.vertices), np.float32)
    mesh.color_attributes["Coat"].data.foreach_get("color", colours)
    colours = colours.reshape(-1, 4)[:, :3]
    labels = {key.frame: key.label for key in character.keys}

    strip = Strip(look, faces, colours, 8)
    for name in character.shapes:
        shape = np.empty(3 * len(mesh.vertices), np.float32)
        mesh.shape_keys.key_blocks[name].data.foreach_get("co", shape)
        shape = shape.reshape(-1, 3)
        strip.add(shape, name, True, dots_of_exemplar(shape, character.handles))
    for frame in character.strip:
        label = f"{frame}: {labels[frame]}" if frame in labels else str(frame)
        dots = dots_of_empties(character.handles, frame)
        strip.add(frames[frame], label, frame in labels, dots)
    strip.render(folder / f"{character.name}.png", 360, character.title)

    sheet = Strip(look, faces, colours, 10)
    for frame, shape in frames.items():
        sheet.add(shape, str(frame), frame in labels)
    sheet.render(folder / f"{character.name}_frames.png", 160)


def main(name, folder):
    if hasattr(bpy.types.Object, "exemplar"):
        raise RuntimeError("this is about a Blender without the add-on")
    character = modelled(name, folder)
    obj = bpy.data.objects[name]
    draw(obj, character, play(obj, folder / f"{name}.pc2"), folder)


if __name__ == "__main__":
    try:
        words = sys.argv[sys.argv.index("--") + 1 :]
        main(words[0], Path(words[1]).resolve())
    except Exception:
        traceback.print_exc()
        sys.exit(1)
