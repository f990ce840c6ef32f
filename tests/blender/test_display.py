# SPDX-License-Identifier: GPL-3.0-or-later
"""What is shown besides the mesh: presets, influence, figures; and that all says what it is."""

import inspect
import os
import re
import sys
import tempfile

import bpy
import numpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings  # noqa: E402
from blender_addon import MODULES, _modules  # noqa: E402
from blender_addon.scene import figures, influence, presets, results  # noqa: E402


class Presets(SceneCase):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        original = presets._folder
        presets._folder = lambda: presets.Path(folder.name) / "made when needed"
        self.addCleanup(setattr, presets, "_folder", original)

    def test_our_own(self):
        bar, _ = support.make_rig()
        for name, (kind, values) in presets.OWN.items():
            bpy.ops.exemplar.preset_apply(name=name)
            self.assertEqual(bar.exemplar.deformer, kind)
            for key, value in values.items():
                self.assertEqual(getattr(bar.exemplar.amrap, key), value, (name, key))

    def test_save_apply_remove(self):
        bar, empties = support.make_rig()
        bar.exemplar.amrap.lambda_ = 1.25
        bar.exemplar.amrap.blend = "GLOBAL"
        bpy.ops.exemplar.preset_save(name="Mine")
        self.assertEqual(presets.saved_names(), ["Mine"])
        bpy.ops.exemplar.preset_apply(name="Body")
        self.assertEqual(bar.exemplar.amrap.blend, "LOCAL")
        bpy.ops.exemplar.preset_apply(name="Mine")
        self.assertEqual((bar.exemplar.amrap.lambda_, bar.exemplar.amrap.blend), (1.25, "GLOBAL"))
        bpy.ops.exemplar.preset_remove(name="Mine")
        self.assertEqual(presets.saved_names(), [])

    def test_the_mesh_follows_a_preset(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.6, 0.2, 2.1)
        support.update()
        before = support.visible(bar)
        bpy.ops.exemplar.preset_apply(name="Face")
        support.update()
        self.assertFar(support.visible(bar), before)
        self.assertClose(support.visible(bar), support.solved(bar), 1e-5)

    def test_bad_names_and_files(self):
        bar, _ = support.make_rig()
        for name in ("", "  ", "a/b", ".hidden", "Body", "x" * 100):
            self.assertFails("cannot be the name", bpy.ops.exemplar.preset_save, name=name)
        self.assertFails("cannot be read", bpy.ops.exemplar.preset_apply, name="Nothing")
        self.assertFails("cannot be removed", bpy.ops.exemplar.preset_remove, name="Nothing")
        presets._folder().mkdir()
        broken = {
            "not json": "{",
            "other kind": '{"deformer": "MAGIC", "settings": {}}',
            "other setting": '{"deformer": "AMRAP", "settings": {"lambda_": 9.0, "magic": 1}}',
            "other type": '{"deformer": "AMRAP", "settings": {"lambda_": 9.0, "blend": 3}}',
        }
        for name, text in broken.items():
            (presets._folder() / f"{name}.json").write_text(text)
            self.assertFails("Preset", bpy.ops.exemplar.preset_apply, name=name)
            self.assertEqual(bar.exemplar.amrap.lambda_, 0.5, "nothing half set")


class Influence(SceneCase):
    def colours(self, obj):
        layer = results.shown_object(obj).data.color_attributes[influence.ATTRIBUTE]
        values = numpy.empty((len(layer.data), 4), numpy.float32)
        layer.data.foreach_get("color", values.ravel())
        return values[:, :3]

    def test_shares_sum_to_one(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.6, 0.2, 2.1)
        support.update()
        total = sum(influence.weights(bar, name) for name in ("Basis", "Bend", "Fat"))
        self.assertClose(total, numpy.ones(len(total)), 1e-6)

    def test_an_exemplar_is_all_red(self):
        for target in ("KEY", "OBJECT"):
            bpy.ops.wm.read_factory_settings(use_empty=True)
            bar, _ = support.make_rig(bind=False)
            bar.exemplar.target = target
            bpy.ops.exemplar.bind()
            bpy.ops.exemplar.pose_to_exemplar(name="Bend")
            bpy.ops.exemplar.influence_show(name="Bend")
            self.assertClose(
                self.colours(bar), numpy.tile(influence.colours.RAMP[-1], (104, 1)), 1e-3
            )
            bpy.ops.exemplar.influence_show(name="Fat")
            self.assertClose(
                self.colours(bar), numpy.tile(influence.colours.RAMP[0], (104, 1)), 1e-3
            )

    def test_hide_leaves_no_trace_and_the_artists_colours(self):
        bar, _ = support.make_rig()
        mine = bar.data.color_attributes.new("Mine", "FLOAT_COLOR", "POINT")
        mine.data.foreach_set("color", numpy.full(4 * 104, 0.3, numpy.float32))
        bpy.ops.exemplar.influence_show(name="Bend")
        self.assertEqual(support.problem(bar), "")
        bpy.ops.exemplar.influence_hide()
        self.assertEqual([layer.name for layer in bar.data.color_attributes], ["Mine"])
        bpy.ops.exemplar.influence_hide()

    def test_refusals(self):
        bar, _ = support.make_rig()
        self.assertFails("not an exemplar", bpy.ops.exemplar.influence_show, name="Nobody")
        bpy.ops.exemplar.unbind()
        self.assertFails("Bind the mesh first", bpy.ops.exemplar.influence_show, name="Bend")


class Figures(SceneCase):
    def test_only_on_demand(self):
        bar, empties = support.make_rig()
        figures.forget()
        empties[2].location = (0.4, 0.2, 2.1)
        support.update()
        self.assertIsNone(figures.of_late())
        bpy.context.window_manager.exemplar_display.show_figures = True
        for step in range(5):
            empties[2].location.x += 0.05
            support.update()
        seen = figures.of_late()
        self.assertEqual(seen.frames, 5)
        self.assertGreater(seen.own, seen.solve)
        self.assertGreater(seen.per_second, 0)
        self.assertEqual(seen.iterations, bindings.state_of(bar).result.report.iterations)


class Shape(SceneCase):
    def test_only_meshes_and_kept_in_the_file(self):
        bar, empties = support.make_rig()
        ring = support.make_bar("Ring")
        bar.exemplar.handles[0].shape = ring
        bpy.data.collections.get("Collection") or bpy.context.collection.objects.unlink(ring)
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "a.blend")
            bpy.ops.wm.save_as_mainfile(filepath=path)
            bpy.ops.wm.open_mainfile(filepath=path)
        shape = bpy.data.objects["Bar"].exemplar.handles[0].shape
        self.assertEqual(shape.name, "Ring")


class Words(SceneCase):
    """Everything that an artist sees says what it does, in a sentence without a full stop."""

    def classes(self):
        for module in _modules():
            for _, value in inspect.getmembers(module, inspect.isclass):
                if getattr(value, "is_registered", False) and value.__module__ == module.__name__:
                    yield value

    def check_sentence(self, text, what):
        self.assertGreater(len(text), 10, what)
        self.assertTrue(text[0].isupper() or text[0].isdigit(), (what, text))
        self.assertFalse(text.endswith("."), (what, text))

    def test_operators(self):
        found = [c for c in self.classes() if issubclass(c, bpy.types.Operator)]
        self.assertGreater(len(found), 15)
        for operator in found:
            self.check_sentence(operator.bl_description, operator.__name__)
            self.assertIn("UNDO", operator.bl_options, operator.__name__)

    def test_properties(self):
        count = 0
        for owner in self.classes():
            if not issubclass(owner, (bpy.types.PropertyGroup, bpy.types.Operator)):
                continue
            rna = owner.bl_rna
            if issubclass(owner, bpy.types.Operator):
                rna = getattr(bpy.ops.exemplar, owner.bl_idname.split(".")[1]).get_rna_type()
            for prop in rna.properties:
                own = prop.identifier in getattr(owner, "__annotations__", {}) or any(
                    prop.identifier in getattr(base, "__annotations__", {})
                    for base in owner.__mro__
                    if base.__module__.startswith("blender_addon")
                )
                if not own or prop.is_hidden or prop.type == "COLLECTION":
                    continue
                if prop.type == "POINTER" and not prop.description:
                    continue  # a group of properties, which are looked at themselves
                what = f"{owner.__name__}.{prop.identifier}"
                self.check_sentence(prop.description, what)
                self.assertNotEqual(prop.name, prop.identifier, what)
                for item in prop.enum_items if prop.type == "ENUM" else ():
                    self.check_sentence(item.description, f"{what}.{item.identifier}")
                count += 1
        self.assertGreater(count, 30)

    def test_no_words_of_programmers(self):
        words = re.compile(r"\b(operator|RNA|datablock|API|null|boolean|enum|callback)\b", re.I)
        for owner in self.classes():
            self.assertNotRegex(getattr(owner, "bl_description", "") or "", words)

    def test_every_module_is_registered(self):
        for folder in ("operators", "ui"):
            for name in os.listdir(support.ROOT / "blender_addon" / folder):
                stem = name.removesuffix(".py")
                source = support.ROOT / "blender_addon" / folder / name
                if name.endswith(".py") and "def register" in source.read_text():
                    self.assertIn(f"{folder}.{stem}", MODULES)


if __name__ == "__main__":
    support.run(globals())
