# SPDX-License-Identifier: GPL-3.0-or-later
"""Save, load, undo, redo, append, link; the add-on switched off and on."""

import os
import sys
import tempfile

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings, blender_addon  # noqa: E402
from blender_addon.scene import live, rigs  # noqa: E402


class FileCase(SceneCase):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = os.path.join(folder.name, "rig.blend")

    def follows(self, bar, place=(0.4, 0.3, 2.2)):
        """A handle that is moved takes the mesh along."""
        top = bar.exemplar.handles[2].empty
        top.location = place
        support.update()
        self.assertEqual(support.problem(bar), "")
        shown = support.visible(bar)
        self.assertClose(shown[support.level(12)].mean(axis=0), place, 1e-4)
        self.assertClose(shown, support.solved(bar), 1e-5)


class SaveAndLoad(FileCase):
    def test_reload(self):
        bar, empties = support.make_rig(kinds=("PINNED", "ORIENTED", "PINNED"))
        bar.exemplar.amrap.lambda_ = 0.8
        empties[2].location = (0.6, 0, 2.1)
        empties[1].rotation_euler.y = 0.3
        support.update()
        posed = support.visible(bar)
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bar = bpy.data.objects["Bar"]
        self.assertEqual(bindings.deformer_count(), 0)
        self.assertAlmostEqual(bar.exemplar.amrap.lambda_, 0.8, 6)
        self.assertClose(support.visible(bar), posed, 0)
        support.update()
        self.assertClose(support.solved(bar), posed, 1e-5)
        self.follows(bar)

    def test_frame_change_after_reload(self):
        bar, empties = support.make_rig()
        empties[2].keyframe_insert("location", frame=1)
        empties[2].location = (0.6, 0, 2.1)
        empties[2].keyframe_insert("location", frame=9)
        self.scene.frame_set(7)
        expected = support.visible(bar)
        self.scene.frame_set(1)
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bpy.context.scene.frame_set(7)
        self.assertClose(support.visible(bpy.data.objects["Bar"]), expected, 1e-6)

    def test_separate_object_survives(self):
        bar, _ = support.make_rig(bind=False)
        bar.exemplar.target = "OBJECT"
        bpy.ops.exemplar.bind()
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        self.follows(bpy.data.objects["Bar"])

    def test_unbound_handles_survive(self):
        support.make_rig(bind=False)
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        support.activate(bpy.data.objects["Bar"])
        bpy.ops.exemplar.bind()
        self.follows(bpy.data.objects["Bar"])

    def test_another_file_closes_the_deformers(self):
        support.make_rig()
        self.assertEqual(bindings.deformer_count(), 1)
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        self.assertEqual(bindings.deformer_count(), 0)

    def test_edited_without_the_addon(self):
        """A key that was edited while nobody watched."""
        bar, empties = support.make_rig()
        bar.data.shape_keys.key_blocks["Fat"].data[7].co.x += 0.2
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bar = bpy.data.objects["Bar"]
        bar.exemplar.handles[2].empty.location.x += 0.1
        support.update()
        self.assertIn("Exemplar 'Fat' was edited since Bind", support.problem(bar))


class Undo(FileCase):
    def setUp(self):
        super().setUp()
        bpy.ops.ed.undo_push(message="Start")

    def bar(self):
        return bpy.data.objects["Bar"]

    def test_undo_and_redo_of_bind(self):
        support.make_rig(bind=False)
        bpy.ops.ed.undo_push(message="Handles")
        bpy.ops.exemplar.bind()
        bpy.ops.ed.undo_push(message="Bind")
        bpy.ops.ed.undo()
        self.assertFalse(self.bar().exemplar.bound)
        self.assertNotIn("Exemplar Result", self.bar().data.shape_keys.key_blocks)
        support.update()
        bpy.ops.ed.redo()
        self.assertTrue(self.bar().exemplar.bound)
        self.follows(self.bar())

    def test_undo_and_redo_of_a_move(self):
        bar, empties = support.make_rig()
        bpy.ops.ed.undo_push(message="Bind")
        before = support.visible(bar)
        empties[2].location = (0.6, 0, 2.1)
        support.update()
        after = support.visible(bar)
        bpy.ops.ed.undo_push(message="Move")
        bpy.ops.ed.undo()
        support.update()
        self.assertClose(support.visible(self.bar()), before, 1e-6)
        bpy.ops.ed.redo()
        support.update()
        self.assertClose(support.visible(self.bar()), after, 1e-6)
        self.follows(self.bar())

    def test_undo_of_unbind(self):
        support.make_rig()
        bpy.ops.ed.undo_push(message="Bind")
        bpy.ops.exemplar.unbind()
        bpy.ops.ed.undo_push(message="Unbind")
        bpy.ops.ed.undo()
        self.assertTrue(self.bar().exemplar.bound)
        self.follows(self.bar())

    def test_undo_of_rebind(self):
        bar, _ = support.make_rig()
        bpy.ops.ed.undo_push(message="Bind")
        support.add_handle(bar, support.level(9))
        bpy.ops.exemplar.rebind()
        bpy.ops.ed.undo_push(message="Rebind")
        bpy.ops.ed.undo()
        self.follows(self.bar())
        info = bindings.state_of(self.bar()).deformer.info
        self.assertEqual(info.handle_count, len(self.bar().exemplar.handles))

    def test_undo_of_a_deleted_empty(self):
        bar, empties = support.make_rig()
        bpy.ops.ed.undo_push(message="Bind")
        support.activate(empties[2])
        bpy.ops.object.delete()
        support.update()
        self.assertIn("deleted", support.problem(bar))
        bpy.ops.ed.undo_push(message="Delete")
        bpy.ops.ed.undo()
        self.follows(self.bar())

    def test_undo_of_a_deleted_object(self):
        bar, _ = support.make_rig()
        bpy.ops.ed.undo_push(message="Bind")
        support.activate(bar)
        bpy.ops.object.delete()
        bpy.ops.ed.undo_push(message="Delete")
        support.update()
        bpy.ops.ed.undo()
        self.follows(self.bar())

    def test_deformers_do_not_pile_up(self):
        for index in range(6):
            bar, empties = support.make_rig(f"Bar{index}")
            for obj in (bar, *empties):
                bpy.data.objects.remove(obj)
        bindings.prune()
        self.assertLessEqual(bindings.deformer_count(), bindings.ORPHANS_KEPT)


class Append(FileCase):
    def setUp(self):
        super().setUp()
        support.make_rig()
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)

    def append(self, link=False):
        bpy.ops.wm.append(
            filepath=os.path.join(self.path, "Object", "Bar"),
            directory=os.path.join(self.path, "Object"),
            filename="Bar",
            link=link,
        )

    def test_append(self):
        self.append()
        self.follows(bpy.data.objects["Bar"])

    def test_append_twice(self):
        self.append()
        with bpy.data.libraries.load(self.path) as (_, wanted):
            wanted.objects = ["Bar"]
        second = wanted.objects[0]
        collection = bpy.context.collection
        for obj in (second, *(item.empty for item in second.exemplar.handles)):
            if not obj.users_scene:
                collection.objects.link(obj)
        support.update()
        first = bpy.data.objects["Bar"]
        self.assertNotEqual(first, second)
        self.follows(first, (0.5, 0, 2.2))
        self.follows(second, (0, 0.5, 2.2))
        self.assertNotEqual(first.exemplar.uuid, second.exemplar.uuid)
        self.assertFar(support.visible(first), support.visible(second))

    def test_library_override(self):
        with bpy.data.libraries.load(self.path, link=True) as (_, wanted):
            wanted.objects = ["Bar"]
        linked = wanted.objects[0]
        override = linked.override_create(remap_local_usages=True)
        for item in override.exemplar.handles:
            item.empty.override_create(remap_local_usages=True)
        bpy.context.collection.objects.link(override)
        for item in override.exemplar.handles:
            bpy.context.collection.objects.link(item.empty)
        support.update()
        self.assertIsNone(override.library)
        self.follows(override)

    def test_library_override_with_a_separate_object(self):
        """As the Outliner makes it: of all that belongs together."""
        bpy.ops.wm.open_mainfile(filepath=self.path)
        bar = bpy.data.objects["Bar"]
        bar.exemplar.target = "OBJECT"
        support.activate(bar)
        bpy.ops.exemplar.rebind()
        rigs = bpy.data.collections.new("Rig")
        bpy.context.scene.collection.children.link(rigs)
        for obj in list(bpy.context.scene.objects):
            rigs.objects.link(obj)
        bpy.ops.wm.save_as_mainfile(filepath=self.path)
        bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
        with bpy.data.libraries.load(self.path, link=True) as (_, wanted):
            wanted.collections = ["Rig"]
        scene = bpy.context.scene
        overridden = wanted.collections[0].override_hierarchy_create(
            scene, bpy.context.view_layer, do_fully_editable=True
        )
        self.assertIsNone(overridden.library)
        support.update()
        override = next(
            o
            for o in scene.objects
            if o.name.startswith("Bar") and not o.library and o.exemplar.bound
        )
        self.follows(override)
        self.assertIsNone(override.exemplar.result_object.library)


class OffAndOn(FileCase):
    def test_disable_and_enable_while_bound(self):
        bar, empties = support.make_rig()
        counts = self._handlers()
        blender_addon.unregister()
        try:
            self.assertEqual(self._handlers(), [0] * len(counts))
            self.assertFalse(hasattr(bpy.types.Object, "exemplar"))
            self.assertEqual(bindings.deformer_count(), 0)
            empties[2].location.x += 0.3
            support.update()
        finally:
            blender_addon.register()
        self.assertEqual(self._handlers(), counts)
        self.follows(bar)

    def test_result_stays_without_the_addon(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.6, 0, 2.1)
        support.update()
        posed = support.visible(bar)
        blender_addon.unregister()
        try:
            evaluated = bar.evaluated_get(support.depsgraph())
            self.assertClose(support.versions.get_mesh_positions(evaluated.data), posed, 0)
        finally:
            blender_addon.register()

    def test_register_twice_over(self):
        for _ in range(3):
            blender_addon.unregister()
            blender_addon.register()
        bar, _ = support.make_rig()
        self.follows(bar)

    def _handlers(self):
        return [
            sum(f.__module__ == live.__name__ for f in getattr(bpy.app.handlers, name))
            for name, _ in live._HANDLERS
        ]


class Rigs(SceneCase):
    def test_other_objects_get_no_properties(self):
        cube = support.make_bar("Plain", poses={})
        support.make_rig()
        self.assertFalse(cube.is_property_set("exemplar"))

    def test_rig_of(self):
        bar, empties = support.make_rig(bind=False)
        stranger = bpy.data.objects.new("Stranger", None)
        self.scene.collection.objects.link(stranger)
        self.assertEqual(rigs.rig_of(empties[1]), bar)
        self.assertEqual(rigs.rig_of(bar), bar)
        self.assertIsNone(rigs.rig_of(stranger))
        self.assertIsNone(rigs.rig_of(None))


if __name__ == "__main__":
    support.run(globals())
