# SPDX-License-Identifier: GPL-3.0-or-later
"""Nothing is lost: save and reload, append, undo, copies; and bakes, renders and the command line
show what the viewport shows."""

import os
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import bake_support  # noqa: E402
import bmesh  # noqa: E402
import bpy  # noqa: E402
import numpy  # noqa: E402
from blender_addon.scene.baking import mdd, pc2  # noqa: E402
from blender_addon.scene.sequences import packing  # noqa: E402
from sequence_support import (  # noqa: E402
    FIRST,
    LAST,
    SequenceCase,
    evaluated,
    frames_of,
    live,
    move,
    owners,
    store,
)

RANGE = range(FIRST, LAST + 1)


def named(name="Bar Sequence"):
    """Undo and load replace objects, so they are looked up each time."""
    return bpy.data.objects[name]


class FileCase(SequenceCase):
    def setUp(self):
        super().setUp()
        # Blender's own session folder goes when another file is loaded.
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.blend = str(self.folder / "scene.blend")

    def edited(self):
        """A sequence with a moved point, a new point and a moved mark; its frames."""
        owner = self.capture()
        data = owner.exemplar_sequence
        move(data.marks, [4], (0.05, -0.1))
        move(data.curve, [9], (0.1, 0.05))
        self.subdivide(owner)
        return owner, frames_of(owner, RANGE)

    def subdivide(self, owner):
        mesh = owner.exemplar_sequence.curve.data
        edit = bmesh.new()
        edit.from_mesh(mesh)
        edit.edges.ensure_lookup_table()
        bmesh.ops.subdivide_edges(edit, edges=[edit.edges[5]], cuts=1)
        edit.verts.ensure_lookup_table()
        edit.verts[-1].co.x += 0.07
        edit.to_mesh(mesh)
        edit.free()
        mesh.update()
        support.update()
        self.assertEqual(self.problem(owner), "")


class Files(FileCase):
    def test_save_and_reload(self):
        owner, expected = self.edited()
        bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        size = os.path.getsize(self.blend)
        bpy.ops.wm.open_mainfile(filepath=self.blend)
        self.assertEqual(store.sequence_count(), 0)
        self.scene = bpy.context.scene
        self.assertClose(frames_of(named(), RANGE), expected, 0)
        self.assertEqual(self.problem(named()), "")
        bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        self.assertLess(abs(os.path.getsize(self.blend) - size), 0.1 * size)

    def test_moves_that_were_not_packed_yet(self):
        """Points are read from the polygon itself."""
        owner = self.capture()
        move(owner.exemplar_sequence.curve, [6], (0.1, 0.05))
        expected = frames_of(owner, RANGE)
        bpy.app.handlers.save_pre.remove(live.on_save)
        try:
            bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        finally:
            bpy.app.handlers.save_pre.append(live.on_save)
        bpy.ops.wm.open_mainfile(filepath=self.blend)
        self.assertClose(frames_of(named(), RANGE), expected, 0)

    def test_append(self):
        owner, expected = self.edited()
        bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        store.clear()
        with bpy.data.libraries.load(self.blend) as (_, into):
            into.objects = ["Bar Sequence"]
        owner = into.objects[0]
        bpy.context.scene.collection.objects.link(owner)
        for part in owners.parts(owner):
            bpy.context.scene.collection.objects.link(part)
        support.update()
        self.assertClose(frames_of(owner, RANGE), expected, 0)

    def test_link_and_override(self):
        _, expected = self.edited()
        bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        bpy.ops.wm.read_factory_settings(use_empty=True)
        store.clear()
        with bpy.data.libraries.load(self.blend, link=True) as (_, into):
            into.objects = ["Bar Sequence"]
        bpy.context.scene.collection.objects.link(into.objects[0])
        support.update()
        self.scene = bpy.context.scene
        self.scene.frame_set(5)
        self.assertIn("Make a library override", self.problem(into.objects[0]))
        owner = into.objects[0].override_create(remap_local_usages=True)
        support.update()
        self.assertClose(frames_of(owner, RANGE), expected, 0)

    def test_damaged_bytes_are_an_error_and_no_crash(self):
        owner = self.capture()
        self.scene.frame_set(5)
        before = evaluated(owner)
        text = owner.exemplar_sequence.data
        whole = packing.read_bytes(text, packing.FIT)
        cases = {
            "cut short": whole[: len(whole) // 2],
            "another byte": whole[:200] + bytes([whole[200] ^ 255]) + whole[201:],
            "nothing": b"",
            "not ours": b"x" * 400,
        }
        for name, data in cases.items():
            with self.subTest(name):
                packing.replace(text, data, "damaged")
                self.scene.frame_set(7)
                self.assertIn("cannot be read", self.problem_of_shown(owner))
                self.assertClose(evaluated(owner), before, 0)
        text[packing.FIT] = "?" * 40
        text[packing.REVISION] = "another"
        self.scene.frame_set(8)
        self.assertIn("is damaged", self.problem_of_shown(owner))
        packing.replace(text, whole, "whole")
        self.scene.frame_set(5)
        self.assertEqual(self.problem_of_shown(owner), "")

    def problem_of_shown(self, owner):
        return str(store.shown(owner).problem or "")

    def test_deleted_text(self):
        owner = self.capture()
        bpy.data.texts.remove(owner.exemplar_sequence.data)
        self.scene.frame_set(7)
        self.assertIn("was deleted", self.problem_of_shown(owner))

    def test_lost_bytes(self):
        owner = self.capture()
        text = owner.exemplar_sequence.data
        del text[packing.FIT]
        text[packing.REVISION] = "another"
        self.scene.frame_set(7)
        self.assertIn("has lost the sequence", self.problem_of_shown(owner))


class Undo(FileCase):
    def push(self, name):
        bpy.ops.ed.undo_push(message=name)

    def test_undo_and_redo_of_edits(self):
        bpy.ops.ed.undo_push(message="start")
        owner = self.capture()
        self.push("captured")
        states = [frames_of(named(), RANGE)]
        move(owner.exemplar_sequence.curve, [7], (0.1, 0.0))
        self.push("point")
        states.append(frames_of(named(), RANGE))
        self.subdivide(named())
        self.push("new point")
        states.append(frames_of(named(), RANGE))
        move(named().exemplar_sequence.marks, [3], (0.0, 0.0))
        support.activate(named())
        bpy.ops.exemplar.sequence_reset_curve()
        self.push("reset")
        states.append(frames_of(named(), RANGE))
        for expected in reversed(states[:-1]):
            bpy.ops.ed.undo()
            self.assertClose(frames_of(named(), RANGE), expected, 1e-6)
        for expected in states[1:]:
            bpy.ops.ed.redo()
            self.assertClose(frames_of(named(), RANGE), expected, 1e-6)

    def test_undo_of_a_moved_mark(self):
        bpy.ops.ed.undo_push(message="start")
        owner = self.capture()
        self.push("captured")
        before = frames_of(owner, RANGE)
        move(owner.exemplar_sequence.marks, [3], (0.3, 0.2))
        self.push("mark")
        after = frames_of(named(), RANGE)
        bpy.ops.ed.undo()
        self.assertClose(frames_of(named(), RANGE), before, 1e-6)
        bpy.ops.ed.redo()
        self.assertClose(frames_of(named(), RANGE), after, 1e-6)


class Copies(FileCase):
    def test_a_copy_has_a_time_of_its_own(self):
        owner = self.capture()
        expected = frames_of(owner, RANGE)
        other = owner.copy()
        other.data = owner.data.copy()
        other.animation_data_clear()
        self.scene.collection.objects.link(other)
        other.exemplar_sequence.time = 4.0
        support.update()
        self.scene.frame_set(9)
        self.assertClose(evaluated(owner), expected[8], 0)
        self.assertClose(evaluated(other), expected[3], 0)
        self.assertEqual(store.sequence_count(), 1)

    def test_a_shared_mesh_is_refused(self):
        owner = self.capture()
        other = owner.copy()
        self.scene.collection.objects.link(other)
        self.scene.frame_set(3)
        self.assertIn("has the same mesh", str(store.shown(other).problem))
        self.assertIsNone(store.shown(owner).problem)

    def test_edited_meshes_are_refused(self):
        owner = self.capture()
        edit = bmesh.new()
        edit.from_mesh(owner.data)
        edit.verts.new((0, 0, 0))
        edit.to_mesh(owner.data)
        edit.free()
        self.scene.frame_set(3)
        self.assertIn("has 105 vertices and its sequence 104", self.problem(owner))

    def test_shape_keys_are_refused(self):
        owner = self.capture()
        owner.shape_key_add(name="Basis")
        self.scene.frame_set(3)
        self.assertIn("has shape keys", self.problem(owner))

    def test_remove(self):
        owner = self.capture()
        self.scene.frame_set(5)
        seen = evaluated(owner)
        support.activate(owner)
        bpy.ops.exemplar.sequence_remove()
        self.scene.frame_set(9)
        self.assertClose(evaluated(owner), seen, 0)
        self.assertEqual(owners.every(), [])
        self.assertEqual(len(bpy.data.texts), 0)
        self.assertEqual(sorted(o.name for o in bpy.data.objects), ["Bar", "Bar Sequence"])
        self.assertFalse(self.source.hide_get() or self.source.hide_render)
        self.assertEqual(store.sequence_count(), 0)


class Bakes(FileCase):
    def test_files(self):
        for kind, read in (("PC2", pc2.read), ("MDD", mdd.read)):
            with self.subTest(kind):
                owner, expected = self.edited()
                path = str(self.folder / f"a.{kind.lower()}")
                bpy.ops.exemplar.bake(format=kind, filepath=path)
                samples = read(path)[-1]
                self.assertClose(samples, expected, 0)
                self.assertFalse(owner.exemplar_sequence.live)
                self.assertClose(frames_of(owner, RANGE), expected, 0)
                bpy.ops.exemplar.bake_remove()
                self.assertTrue(owner.exemplar_sequence.live)
                self.assertClose(frames_of(owner, RANGE), expected, 0)
                bpy.ops.wm.read_factory_settings(use_empty=True)
                self.scene = bpy.context.scene

    def test_shape_keys(self):
        owner, expected = self.edited()
        bpy.ops.exemplar.bake(format="SHAPE_KEYS")
        self.assertEqual(len(owner.data.shape_keys.key_blocks), len(RANGE) + 1)
        self.assertClose(frames_of(owner, RANGE), expected, 1e-6)
        bpy.ops.exemplar.bake_remove()
        self.assertIsNone(owner.data.shape_keys)
        self.assertClose(frames_of(owner, RANGE), expected, 0)

    def test_weights_need_keys(self):
        owner = self.capture()
        self.assertFails("no shape keys to give values to", bpy.ops.exemplar.bake, format="WEIGHTS")
        self.assertTrue(owner.exemplar_sequence.live)

    def test_from_a_part_of_the_pose_space(self):
        owner = self.capture()
        support.activate(owner.exemplar_sequence.playhead)
        path = str(self.folder / "a.pc2")
        self.assertEqual(bpy.ops.exemplar.bake(format="PC2", filepath=path), {"FINISHED"})
        self.assertIsNotNone(owner.modifiers.get("Exemplar Bake"))

    def test_command_line(self):
        owner, expected = self.edited()
        bpy.ops.wm.save_as_mainfile(filepath=self.blend)
        out, saved = self.folder / "a.pc2", self.folder / "saved.blend"
        done = bake_support.blender(
            "--factory-startup", self.blend, "--python", bake_support.COMMAND_LINE, "--",
            "bake", "--object", owner.name, "--out", out, "--save-blend", saved,
        )  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertClose(pc2.read(str(out))[-1], expected, 0)
        bpy.ops.wm.open_mainfile(filepath=str(saved))
        self.assertFalse(named().exemplar_sequence.live)
        self.assertClose(frames_of(named(), RANGE), expected, 0)
        done = bake_support.blender(
            "--factory-startup", self.blend, "--python", bake_support.COMMAND_LINE, "--", "list"
        )
        self.assertIn("Bar Sequence: a sequence", done.stdout)

    def test_renders_with_motion_blur(self):
        """A render's pixels do not depend on what was shown before, nor on the window's frame."""
        owner, _ = self.edited()
        support.small_render(self.scene)
        self.scene.render.use_motion_blur = True
        pictures = []
        for before in (2, 13):
            self.scene.frame_set(before)
            self.scene.frame_set(7)
            self.scene.render.filepath = str(self.folder / f"{before}.png")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(self.scene.render.filepath)
            pixels = numpy.empty(len(image.pixels), numpy.float32)
            image.pixels.foreach_get(pixels)
            pictures.append(pixels)
        self.assertGreater(float(numpy.ptp(pictures[0])), 0.1)
        self.assertClose(pictures[0], pictures[1], 0)
        owner.exemplar_sequence.live = False
        self.scene.frame_set(7)
        self.assertEqual(self.problem(owner), "")


if __name__ == "__main__":
    support.run(globals())
