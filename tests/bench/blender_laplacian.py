# SPDX-License-Identifier: GPL-3.0-or-later
"""Inside Blender: frames of a drag with the Laplacian Deform modifier; measure.py's Worker asks.

Hooks move the anchors and the modifier deforms the rest. "frame" answers the processor time of
setting the next frame's handles and evaluating the object, "hooks" the same without the modifier.
"""

import sys
import time

import bpy
import numpy


def load():
    with numpy.load(sys.argv[sys.argv.index("--") + 1]) as arrays:
        return {name: arrays[name] for name in arrays.files}


def make_object(data):
    mesh = bpy.data.meshes.new("character")
    mesh.from_pydata(data["positions"].tolist(), [], data["triangles"].tolist())
    character = bpy.data.objects.new("character", mesh)
    bpy.context.scene.collection.objects.link(character)
    bpy.context.view_layer.objects.active = character
    character.select_set(True)
    character.vertex_groups.new(name="anchors").add(data["vertices"].tolist(), 1.0, "REPLACE")
    return character


def add_hooks(character, data):
    empties = []
    offsets = data["offsets"]
    for h, (begin, end) in enumerate(zip(offsets, offsets[1:])):
        empty = bpy.data.objects.new(f"handle{h}", None)
        bpy.context.scene.collection.objects.link(empty)
        hook = character.modifiers.new(f"hook{h}", "HOOK")
        hook.object = empty
        hook.vertex_indices_set(data["vertices"][begin:end].tolist())
        empties.append(empty)
    return empties


def add_laplacian(character):
    modifier = character.modifiers.new("laplacian", "LAPLACIANDEFORM")
    modifier.vertex_group = "anchors"
    modifier.iterations = 1
    bpy.ops.object.laplaciandeform_bind(modifier=modifier.name)
    if not modifier.is_bind:
        raise RuntimeError("Laplacian Deform did not bind")
    return modifier


def evaluate(character, empties, displacements):
    start = time.process_time()
    for empty, moved in zip(empties, displacements):
        empty.location = moved
    graph = bpy.context.evaluated_depsgraph_get()
    mesh = character.evaluated_get(graph).data
    seconds = time.process_time() - start
    positions = numpy.empty(3 * len(mesh.vertices), numpy.float32)
    mesh.vertices.foreach_get("co", positions)
    return seconds, positions.reshape(-1, 3)


def check(positions, data, displacements):
    """The anchors are where the handles have them, and other vertices have moved as well."""
    held = data["vertices"]
    moved = numpy.repeat(displacements, numpy.diff(data["offsets"]), axis=0)
    miss = numpy.abs(positions[held] - (data["positions"][held] + moved)).max()
    others = numpy.delete(positions - data["positions"], held, axis=0)
    if miss > 1e-2 * numpy.ptp(data["positions"]) or numpy.abs(others).max() < 1e-6:
        raise RuntimeError(f"Laplacian Deform did not deform: anchors miss by {miss:.3g}")


def answer(*values):
    print("=", *values, flush=True)


def main():
    data = load()
    character = make_object(data)
    empties = add_hooks(character, data)
    bpy.context.view_layer.update()
    modifier = add_laplacian(character)
    frames = data["displacements"]
    _, positions = evaluate(character, empties, frames[0])
    check(positions, data, frames[0])
    answer()
    frame = 0
    for command in sys.stdin:
        modifier.show_viewport = command.strip() != "hooks"
        if command.strip() == "hooks":
            bpy.context.view_layer.update()
        frame = (frame + 1) % len(frames)
        answer(evaluate(character, empties, frames[frame])[0])


main()
