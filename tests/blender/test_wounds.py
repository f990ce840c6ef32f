# SPDX-License-Identifier: GPL-3.0-or-later
"""What breaks add-ons of this kind, where no other file here has it.

render with motion blur             addon_live.Stateless.motion_blur
render while the window is open     addon_window.Window.render
save, quit, reload, render          here
undo across a bind                  addon_files.Undo
linked, with library override       addon_files.Append.library_override...
two characters with one mesh        addon_bind.Results.mesh_of_two_objects, addon_live.Copies
object renamed                      addon_live.Disturbed.object_renamed, and here across files
scene switched                      here, and addon_live.Several
disabled and enabled while bound    addon_files.OffAndOn
opened without the add-on           here, and addon_files.OffAndOn.result_stays_without_the_addon
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import bpy
import numpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings, level  # noqa: E402

# What another Blender does with the file: with the add-on, or without it.
WITH_ADDON = f"""
import sys
sys.path.insert(0, {str(support.ROOT)!r})
import blender_addon
blender_addon.register()
"""
RENDER = "import bpy; bpy.ops.render.render(animation=True)"


class AnotherBlender(SceneCase):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)

    def make(self):
        bar, empties = support.make_rig()
        empties[2].keyframe_insert("location", frame=1)
        empties[2].location = (0.9, 0, 2.0)
        empties[2].keyframe_insert("location", frame=5)
        support.small_render(self.scene)
        self.scene.frame_start, self.scene.frame_end, self.scene.frame_step = 1, 5, 4
        self.scene.frame_set(1)
        return bar

    def save(self, prefix):
        self.scene.render.filepath = str(self.folder / prefix)
        bpy.ops.wm.save_as_mainfile(filepath=str(self.folder / "shot.blend"))

    def in_another(self, *expressions):
        command = [bpy.app.binary_path, "-b", "--factory-startup", self.folder / "shot.blend"]
        for expression in expressions:
            command += ["--python-expr", expression]
        done = subprocess.run(
            [str(word) for word in command], capture_output=True, text=True, timeout=300
        )
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertNotIn("Traceback", done.stdout + done.stderr)
        return done.stdout

    def picture(self, prefix, frame):
        image = bpy.data.images.load(str(self.folder / f"{prefix}{frame:04d}.png"))
        pixels = numpy.empty(len(image.pixels), numpy.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels

    def test_save_quit_reload_render(self):
        self.make()
        self.scene.render.filepath = str(self.folder / "here")
        bpy.ops.render.render(animation=True)
        self.save("there")
        self.in_another(WITH_ADDON, RENDER)
        for frame in (1, 5):
            self.assertClose(self.picture("there", frame), self.picture("here", frame), 0.02)
        self.assertFar(self.picture("there", 5), self.picture("there", 1), 0.1)

    def test_opened_without_the_addon(self):
        """It opens, renders the pose that was saved, and is none the worse when it comes back."""
        bar = self.make()
        self.scene.frame_set(5)
        posed = support.visible(bar)
        self.save("without")
        again = "import bpy; bpy.ops.wm.save_mainfile()"
        self.in_another(RENDER, again)
        self.assertFar(self.picture("without", 1), numpy.zeros(1), 0.1)
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "shot.blend"))
        bar = bpy.data.objects["Bar"]
        self.assertTrue(bar.exemplar.bound)
        bpy.context.scene.frame_set(5)
        self.assertClose(support.visible(bar), posed, 1e-5)
        self.assertEqual(support.problem(bar), "")

    def test_renamed_without_the_addon(self):
        self.make()
        self.save("renamed")
        rename = (
            "import bpy; bpy.data.objects['Bar'].name = 'Hero'; "
            "bpy.data.objects['Handle.003'].name = 'Head'; bpy.ops.wm.save_mainfile()"
        )
        self.in_another(rename)
        bpy.ops.wm.open_mainfile(filepath=str(self.folder / "shot.blend"))
        hero = bpy.data.objects["Hero"]
        bpy.context.scene.frame_set(5)
        self.assertClose(support.visible(hero)[level(12)].mean(axis=0), (0.9, 0, 2.0), 1e-4)
        self.assertEqual(support.problem(hero), "")


class SceneSwitched(SceneCase):
    def test_away_and_back(self):
        """Another scene in the window, work there, and back: the mesh goes on as it was."""
        bar, empties = support.make_rig()
        empties[2].location = (0.4, 0, 2.2)
        support.update()
        posed = support.visible(bar)
        other = bpy.data.scenes.new("Other")
        bpy.context.window.scene = other
        second = support.make_bar("Second")
        support.activate(second)
        for where in (0, 12):
            support.add_handle(second, level(where))
        bpy.ops.exemplar.bind()
        second.exemplar.handles[1].empty.location = (0, 0.5, 2.2)
        support.update()
        self.assertClose(support.visible(second)[level(12)].mean(axis=0), (0, 0.5, 2.2), 1e-4)
        bpy.context.window.scene = self.scene
        support.update()
        self.assertClose(support.visible(bar), posed, 0)
        before = support.solves(bar)
        empties[2].location = (0.2, 0.1, 2.3)
        support.update()
        self.assertEqual(support.solves(bar), before + 1)
        self.assertClose(support.visible(bar)[level(12)].mean(axis=0), (0.2, 0.1, 2.3), 1e-4)
        self.assertEqual(bindings.deformer_count(), 2)


if __name__ == "__main__":
    support.run(globals())
