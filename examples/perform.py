# SPDX-License-Identifier: GPL-3.0-or-later
"""One character from nothing to a bake, with the add-on: model, handles, bind, keyframes, PC2.

    blender -b --factory-startup --addons exemplar --python perform.py -- creature FOLDER

Then solves every frame again, in another order, and compares with the file. Leaves a .blend that
plays the file with or without the add-on. Exit code 1 if anything is not as it should be.
"""

import math
import random
import sys
import time
import traceback
from pathlib import Path

import bpy
import numpy as np
from mathutils import Matrix

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from characters.character import modelled  # noqa: E402
from pc2 import read_pc2  # noqa: E402

TOLERANCE = 1e-6  # of the bounding box diagonal


# ------------------------------------------------------------------------------------- the mesh


def make_mesh_object(name, positions, faces, colours):
    mesh = bpy.data.meshes.new(name)
    mesh.from_pydata(positions.tolist(), [], faces.tolist())
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    layer = mesh.color_attributes.new("Coat", "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", np.hstack([colours, np.ones((len(positions), 1))]).ravel())
    obj = bpy.data.objects.new(name, mesh)
    bpy.context.collection.objects.link(obj)
    return obj


def make_object(character):
    """A mesh with its colours and one shape key an exemplar."""
    basis = character.shapes["Basis"]
    obj = make_mesh_object(character.name, basis, character.faces, character.colours)
    for name, shape in character.shapes.items():
        key = obj.shape_key_add(name=name, from_mix=False)
        key.value = 0.0  # Blender 5 begins at 1
        key.data.foreach_set("co", shape.astype(np.float32).ravel())
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    return obj


# -------------------------------------------------------------------------------- rig and motion


def add_handles(obj, character):
    """As an artist does: in Edit Mode, select vertices, Add Handle."""
    for handle in character.handles:
        chosen = np.zeros(len(obj.data.vertices), dtype=bool)
        chosen[handle.vertices] = True
        for elements in (obj.data.polygons, obj.data.edges):
            elements.foreach_set("select", [False] * len(elements))
        obj.data.vertices.foreach_set("select", chosen)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.tool_settings.mesh_select_mode = (True, False, False)
        run(bpy.ops.exemplar.handle_add, kind=handle.kind)
        bpy.ops.object.mode_set(mode="OBJECT")
        item = obj.exemplar.handles[-1]
        item.empty.name = obj.vertex_groups[item.group].name = item.group = handle.name


def keyframe(obj, character):
    """The empties of pinned and oriented handles, through the character's keys."""
    for key in character.keys:
        for item, handle, target in zip(
            obj.exemplar.handles, character.handles, character.targets(key)
        ):
            if handle.kind == "FREE":
                continue
            centre, turn = target
            place = Matrix(
                turn.tolist() if handle.kind == "ORIENTED" else np.eye(3).tolist()
            ).to_4x4()
            place.translation = centre.tolist()
            item.empty.rotation_mode = "QUATERNION"
            item.empty.matrix_world = obj.matrix_world @ place
            item.empty.keyframe_insert("location", frame=key.frame)
            if handle.kind == "ORIENTED":
                item.empty.keyframe_insert("rotation_quaternion", frame=key.frame)
    scene = bpy.context.scene
    scene.frame_start, scene.frame_end = character.keys[0].frame, character.keys[-1].frame


def run(operator, **options):
    """Operators tell by what they return, and in words on the console."""
    if operator(**options) != {"FINISHED"}:
        raise RuntimeError(f"{operator.idname_py()} did not finish")


def write_obj(path, positions, faces):
    """For the C examples."""
    lines = [f"v {x:.6f} {y:.6f} {z:.6f}" for x, y, z in positions]
    lines += ["f " + " ".join(str(corner + 1) for corner in face) for face in faces]
    path.write_text("\n".join(lines) + "\n")


# -------------------------------------------------------------------------------- bake and check


def check(obj, path):
    """The largest distance between the file and stateless solves, as a share of the diagonal."""
    from exemplar.scene.solving import solve

    scene = bpy.context.scene
    start, baked = read_pc2(path)
    frames = list(range(scene.frame_start, scene.frame_end + 1))
    if start != scene.frame_start or len(baked) != len(frames):
        raise RuntimeError(f"{path.name} has {len(baked)} frames from {start:g}")
    random.Random(1).shuffle(frames)  # a frame must not depend on the one solved before
    worst, seconds, residual, unsettled = 0.0, [], 0.0, 0
    for frame in frames:
        scene.frame_set(frame)
        result = solve(obj, stateless=True)
        difference = np.linalg.norm(result.positions - baked[frame - scene.frame_start], axis=1)
        worst = max(worst, float(difference.max()))
        seconds.append(result.report.seconds)
        residual = max(residual, result.report.constraint_residual)
        unsettled += result.report.capped
    diagonal = float(np.linalg.norm(np.ptp(baked[0], axis=0)))
    median = 1e3 * float(np.median(seconds))
    print(
        f"   stateless solves: {median:.2f} ms median, {1e3 * max(seconds):.2f} ms at most",
        end=", ",
    )
    print(f"{unsettled} of {len(frames)} met the iteration cap, handles met to {residual:.1e}")
    return worst / diagonal


def bindings_of(obj):
    from exemplar.scene import bindings

    return bindings.ensure(obj)


def exemplars_come_back(deformer, character):
    """The largest vertex error where the handles stand as in an exemplar; share of the diagonal."""
    basis = character.shapes["Basis"]
    worst = 0.0
    for index, shape in enumerate(character.shapes.values()):
        deformer.solve(deformer.handle_pose(index))
        error = np.linalg.norm(deformer.positions_f64() - shape.astype(np.float32), axis=1)
        worst = max(worst, float(error.max()))
    return worst / float(np.linalg.norm(np.ptp(basis, axis=0)))


def main(name, folder):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    began = time.perf_counter()
    character = modelled(name, folder)
    obj = make_object(character)
    shown = f"{len(obj.data.vertices)} vertices, {len(character.shapes)} exemplars"
    print(f"   modelled: {shown} ({time.perf_counter() - began:.1f} s)")

    if name == "creature":
        write_obj(folder / "creature_rest.obj", character.shapes["Basis"], character.faces)
        write_obj(folder / "creature_howl.obj", character.shapes["Howl"], character.faces)

    add_handles(obj, character)
    obj.exemplar.amrap.rotations = character.rotations
    began = time.perf_counter()
    run(bpy.ops.exemplar.bind)
    taken = time.perf_counter() - began
    deformer = bindings_of(obj).deformer
    parts = f"{deformer.info.bind_seconds:.2f} s in the library, {deformer.info.weight_seconds:.2f}"
    print(
        f"   bound: {len(character.handles)} handles ({taken:.2f} s, {parts} of them for weights)"
    )
    error = exemplars_come_back(deformer, character)
    print(f"   exemplars come back to {error:.1e} of the diagonal")

    keyframe(obj, character)
    blend, cache = folder / f"{name}.blend", folder / f"{name}.pc2"
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), check_existing=False)
    began = time.perf_counter()
    run(bpy.ops.exemplar.bake, format="PC2", filepath=f"//{name}.pc2")
    print(f"   baked: {cache.name} ({time.perf_counter() - began:.1f} s)")
    worst = check(obj, cache)
    print(f"   bake against stateless solves: {worst:.1e} of the diagonal (allowed {TOLERANCE:g})")
    frame_view(character.look)
    bpy.ops.wm.save_as_mainfile(filepath=str(blend), check_existing=False)
    if worst > TOLERANCE:
        raise RuntimeError("the bake differs from the stateless solves")


def frame_view(look):
    """A camera and the colours shown, so that the file opens, and renders, as the pictures look."""
    scene = bpy.context.scene
    data = bpy.data.cameras.new("Camera")
    data.type, data.ortho_scale = "ORTHO", look.width
    camera = bpy.data.objects.new("Camera", data)
    camera.rotation_euler = (math.radians(90.0 - look.height), 0.0, math.radians(look.heading))
    away = camera.rotation_euler.to_matrix().col[2] * 10.0
    camera.location = [c + a for c, a in zip(look.centre, away)]
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.engine = "BLENDER_WORKBENCH"
    scene.display.shading.color_type = "VERTEX"
    for screen in bpy.data.screens:
        for area in (area for area in screen.areas if area.type == "VIEW_3D"):
            area.spaces.active.shading.color_type = "VERTEX"
    scene.frame_set(scene.frame_start)


if __name__ == "__main__":
    try:
        words = sys.argv[sys.argv.index("--") + 1 :]
        main(words[0], Path(words[1]).resolve())
    except Exception:
        traceback.print_exc()
        sys.exit(1)
