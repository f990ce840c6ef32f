# SPDX-License-Identifier: GPL-3.0-or-later
"""Fit to Scan: a body with five limbs, fitted to scans of it whose faces are others."""

import os
import sys

import bpy
import numpy
from mathutils import Vector

sys.path.insert(0, os.path.dirname(__file__))
import addon_support  # noqa: E402
from fit_support import (  # noqa: E402
    LIMB_COUNT,
    LIMBS,
    PLACE,
    TRUTH,
    body,
    make_body,
    make_scan,
    pose_angles,
    sphere,
    unit,
)

from blender_addon.scene import meshes, versions  # noqa: E402
from blender_addon.scene.baking import mesh_cache, pc2  # noqa: E402
from blender_addon.scene.fitting import inputs, outputs, solving  # noqa: E402


class FitCase(addon_support.SceneCase):
    def setUp(self):
        super().setUp()
        self.directions, _ = sphere(5)
        self.mesh = make_body()
        self.scan = make_scan("Scan", TRUTH)
        self.mesh.exemplar_fit.scan = self.scan
        addon_support.activate(self.mesh)
        self.true = body(self.directions, TRUTH)
        rest = meshes.reference_positions(self.mesh)
        self.size = numpy.sqrt(area(rest, meshes.triangles(self.mesh.data)))

    def tearDown(self):
        solving.forget()
        super().tearDown()

    def landmark(self, limb, name=None, at=None):
        """The tip of a limb, on the mesh and, there or elsewhere, on the scan."""
        item = self.mesh.exemplar_fit.landmarks.add()
        way = unit(LIMBS[limb][0])
        item.name = name or f"Limb {limb}"
        item.vertex = int((self.directions @ way).argmax())
        item.point = body(unit(LIMBS[limb if at is None else at][0])[None], TRUTH)[0]
        return item

    def add_landmarks(self):
        return [self.landmark(limb) for limb in range(LIMB_COUNT)]

    def in_world(self, obj, positions):
        matrix = numpy.array(obj.matrix_world)
        return positions @ matrix[:3, :3].T + matrix[:3, 3]

    def error(self, positions):
        """Root mean square distance from the truth, as a share of the size."""
        return numpy.sqrt(((positions - self.true) ** 2).sum(axis=1).mean()) / self.size


def area(positions, triangles):
    a, b, c = (positions[triangles[:, k]] for k in range(3))
    return numpy.linalg.norm(numpy.cross(b - a, c - a), axis=1).sum() / 2


class Fitting(FitCase):
    def test_object_lies_on_the_scan(self):
        self.add_landmarks()
        own = self.mesh.exemplar_fit
        own.place = "OBJECT"
        self.assertEqual(bpy.ops.exemplar.fit(), {"FINISHED"})
        shown = own.last_object
        found = self.in_world(shown, versions.get_mesh_positions(shown.data))
        self.true = self.in_world(self.scan, self.true)
        self.assertLess(self.error(found), 0.02)
        self.assertFalse(own.is_doubtful, own.message)
        self.assertIsNone(shown.data.shape_keys)
        self.assertEqual(len(self.mesh.data.shape_keys.key_blocks), 5)

    def test_key_is_an_exemplar_at_rest(self):
        self.add_landmarks()
        names = [key.name for key in self.mesh.data.shape_keys.key_blocks]
        before = [versions.get_key_positions(k) for k in self.mesh.data.shape_keys.key_blocks]
        bpy.ops.exemplar.fit()
        blocks = self.mesh.data.shape_keys.key_blocks
        self.assertEqual([key.name for key in blocks], [*names, "Fit Scan"])
        for key, positions in zip(blocks, before):
            self.assertTrue(numpy.array_equal(versions.get_key_positions(key), positions))
        found = versions.get_key_positions(blocks["Fit Scan"])
        self.assertLess(self.error(outputs.onto(found, self.true)), 0.02)
        self.assertClose(found.mean(axis=0), before[0].mean(axis=0), 1e-4)
        # A second fit takes its place, and is not made of it.
        first = found
        bpy.ops.exemplar.fit()
        self.assertEqual(len(blocks), 6)
        self.assertClose(versions.get_key_positions(blocks["Fit Scan"]), first, 1e-6)
        blocks["Fit Scan"].name = "Kept"
        bpy.ops.exemplar.fit()
        self.assertEqual([key.name for key in blocks][-2:], ["Kept", "Fit Scan"])

    def test_scale_is_found(self):
        scan = make_scan("Large", TRUTH, scale=1.5)
        addon_support.activate(self.mesh)
        self.mesh.exemplar_fit.scan = scan
        for item in self.add_landmarks():
            item.point = [1.5 * c for c in item.point]
        self.mesh.exemplar_fit.place = "OBJECT"
        bpy.ops.exemplar.fit()
        self.assertIn("times the size", self.mesh.exemplar_fit.message)
        self.true = self.in_world(scan, 1.5 * self.true)
        shown = self.mesh.exemplar_fit.last_object
        found = self.in_world(shown, versions.get_mesh_positions(shown.data))
        self.assertLess(self.error(found), 0.03)

    def test_attributes(self):
        self.add_landmarks()
        bpy.ops.exemplar.fit()
        self.assertIn(outputs.DISTANCE, self.mesh.data.color_attributes)
        self.assertIn(outputs.DISTANCE, self.scan.data.color_attributes)
        layer = self.scan.data.attributes[outputs.VERTEX]
        vertices = numpy.empty(len(self.scan.data.vertices), numpy.int32)
        layer.data.foreach_get("value", vertices)
        self.assertTrue((vertices >= -1).all() and (vertices < len(self.true)).all())
        seen = vertices >= 0
        self.assertGreater(seen.mean(), 0.5)
        # Each point's vertex is where the point is.
        points = versions.get_mesh_positions(self.scan.data)
        apart = numpy.linalg.norm(points[seen] - self.true[vertices[seen]], axis=1)
        self.assertLess(numpy.median(apart), 0.05 * self.size)

    def test_clouds(self):
        cloud = bpy.data.meshes.new("Cloud")
        positions = versions.get_mesh_positions(self.scan.data)
        cloud.from_pydata([tuple(map(float, p)) for p in positions], [], [])
        self.scan.data = cloud
        self.add_landmarks()
        self.mesh.exemplar_fit.place = "OBJECT"
        bpy.ops.exemplar.fit()
        shown = self.mesh.exemplar_fit.last_object
        self.true = self.in_world(self.scan, self.true)
        found = self.in_world(shown, versions.get_mesh_positions(shown.data))
        self.assertLess(self.error(found), 0.04)

    def test_undo(self):
        self.add_landmarks()
        bpy.ops.ed.undo_push(message="Before")
        bpy.ops.exemplar.fit()
        bpy.ops.ed.undo_push(message="Fit")
        bpy.ops.ed.undo()
        mesh = bpy.data.objects["Body"]
        self.assertNotIn("Fit Scan", mesh.data.shape_keys.key_blocks)
        self.assertEqual(len(mesh.exemplar_fit.landmarks), LIMB_COUNT)


class Landmarks(FitCase):
    def test_from_names(self):
        for limb, (way, _, _) in enumerate(LIMBS):
            group = self.mesh.vertex_groups.new(name=f"Tip {limb}")
            group.add([int((self.directions @ unit(way)).argmax())], 1.0, "REPLACE")
            empty = bpy.data.objects.new(f"Tip {limb}", None)
            bpy.context.collection.objects.link(empty)
            empty.parent = self.scan
            empty.location = body(unit(way)[None], TRUTH)[0]
        bpy.context.view_layer.update()
        self.assertEqual(bpy.ops.exemplar.fit_from_names(), {"FINISHED"})
        items = self.mesh.exemplar_fit.landmarks
        self.assertEqual([item.name for item in items], [f"Tip {k}" for k in range(LIMB_COUNT)])
        self.assertTrue(all(item.empty is not None for item in items))
        self.assertEqual(bpy.ops.exemplar.fit(), {"FINISHED"})

    def test_no_common_names(self):
        self.assertFails("no names in common", bpy.ops.exemplar.fit_from_names)

    def test_from_handles(self):
        for limb, (way, _, _) in enumerate(LIMBS):
            vertex = int((self.directions @ unit(way)).argmax())
            addon_support.add_handle(self.mesh, [vertex], "PINNED")
        bpy.ops.exemplar.fit_from_handles()
        items = self.mesh.exemplar_fit.landmarks
        self.assertEqual(len(items), LIMB_COUNT)
        for item, (way, _, _) in zip(items, LIMBS):
            self.assertEqual(item.vertex, int((self.directions @ unit(way)).argmax()))
            self.assertIsNotNone(item.empty)

    def test_correspondence_is_found(self):
        swapped = [1, 2, 0, 3, 4]
        for limb, at in enumerate(swapped):
            self.landmark(limb, at=at).is_ambiguous = at != limb
        self.assertEqual(bpy.ops.exemplar.fit_match(), {"FINISHED"})
        for limb, item in enumerate(self.mesh.exemplar_fit.landmarks):
            true = body(unit(LIMBS[limb][0])[None], TRUTH)[0]
            self.assertClose(tuple(item.point), true, 1e-5, item.name)

    def test_clicks(self):
        from blender_addon.scene.fitting import landmarks

        depsgraph = bpy.context.evaluated_depsgraph_get()
        way = Vector(unit(LIMBS[0][0]))
        vertex = landmarks.hit_vertex(self.mesh, depsgraph, 10 * way, -way)
        self.assertLess(numpy.arccos(min(1, self.directions[vertex] @ numpy.array(way))), 0.1)
        self.assertIsNone(landmarks.hit_vertex(self.mesh, depsgraph, 10 * way, way))
        origin = PLACE @ Vector((0, 0, 9))
        direction = (PLACE.to_3x3() @ Vector((0, 0, -1))).normalized()
        point = landmarks.hit_point(self.scan, depsgraph, origin, direction)
        local = PLACE.inverted() @ point
        self.assertClose(tuple(local)[:2], (0, 0), 1e-4)

    def test_removed(self):
        self.add_landmarks()
        bpy.ops.exemplar.fit_landmark_remove()
        self.assertEqual(len(self.mesh.exemplar_fit.landmarks), LIMB_COUNT - 1)
        bpy.ops.exemplar.fit_landmark_remove(everything=True)
        self.assertEqual(len(self.mesh.exemplar_fit.landmarks), 0)


class Frames(FitCase):
    def test_frames_are_baked(self):
        tips = []
        for limb in range(LIMB_COUNT):
            item = self.landmark(limb)
            empty = bpy.data.objects.new(item.name, None)
            bpy.context.collection.objects.link(empty)
            item.empty = empty
            tips.append(empty)
        # The scan moves as it is animated: a key that leads from one pose to another.
        self.scan.shape_key_add(name="Basis", from_mix=False)
        key = self.scan.shape_key_add(name="Later", from_mix=False)
        directions, _ = sphere(5, turn=0.37)
        later = pose_angles(2)
        key.data.foreach_set("co", body(directions, later).astype(numpy.float32).ravel())
        for frame, value in ((1, 0.0), (3, 1.0)):
            key.value = value
            key.keyframe_insert("value", frame=frame)
            angles = later if value else TRUTH
            for limb, empty in enumerate(tips):
                place = body(unit(LIMBS[limb][0])[None], angles)[0]
                empty.location = PLACE @ Vector(place)
                empty.keyframe_insert("location", frame=frame)
        own = self.mesh.exemplar_fit
        own.filepath = os.path.join(bpy.app.tempdir, "fits.pc2")
        own.use_scene_range, own.frame_start, own.frame_end, own.frame_step = False, 1, 3, 2
        self.scene.frame_set(2)
        self.assertEqual(bpy.ops.exemplar.fit_sequence(), {"FINISHED"})
        self.assertEqual(self.scene.frame_current, 2)
        header, samples = pc2.read(own.filepath)
        self.assertEqual((header.sample_count, header.start, header.sampling), (2, 1, 2))
        self.true = self.in_world(self.scan, body(self.directions, later))
        self.assertLess(self.error(self.in_world(self.mesh, samples[1])), 0.03)
        self.assertIsNotNone(mesh_cache.find(own.last_object))

    def test_what_is_wrong_names_the_frame(self):
        self.add_landmarks()
        own = self.mesh.exemplar_fit
        own.use_scene_range, own.frame_start, own.frame_end = False, 4, 2
        self.assertFails("comes before the first", bpy.ops.exemplar.fit_sequence)
        own.frame_end, own.filepath = 6, "/nowhere/at/all.pc2"
        self.assertFails("there is no folder", bpy.ops.exemplar.fit_sequence)
        self.assertIsNone(own.last_object)


class BadInput(FitCase):
    def test_too_few_landmarks(self):
        self.assertFails("There are none", bpy.ops.exemplar.fit)
        self.landmark(0)
        self.assertFails("There is one", bpy.ops.exemplar.fit)

    def test_no_scan(self):
        self.mesh.exemplar_fit.scan = None
        self.assertFails("Choose the scan", bpy.ops.exemplar.fit)
        self.mesh.exemplar_fit.scan = self.mesh
        self.add_landmarks()
        self.assertFails("own scan", bpy.ops.exemplar.fit)

    def test_empty_scan(self):
        self.add_landmarks()
        self.scan.data = bpy.data.meshes.new("Nothing")
        self.assertFails("is empty", bpy.ops.exemplar.fit)

    def test_scan_that_is_not_finite(self):
        self.add_landmarks()
        self.scan.data.vertices[7].co.x = float("nan")
        self.assertFails("not numbers, at vertex 7", bpy.ops.exemplar.fit)

    def test_landmark_off_the_mesh(self):
        self.add_landmarks()[2].vertex = 10**6
        self.assertFails("'Limb 2' is vertex 1000000", bpy.ops.exemplar.fit)

    def test_two_landmarks_of_a_vertex(self):
        items = self.add_landmarks()
        items[3].vertex = items[1].vertex
        self.assertFails("'Limb 1' and 'Limb 3' are the same vertex", bpy.ops.exemplar.fit)

    def test_deleted_empty(self):
        item = self.add_landmarks()[0]
        item.empty = bpy.data.objects.new("Gone", None)  # in no scene
        self.assertFails("empty of landmark 'Limb 0' was deleted", bpy.ops.exemplar.fit)

    def test_nothing_is_ambiguous(self):
        self.add_landmarks()
        self.assertFails("two or more landmarks as ambiguous", bpy.ops.exemplar.fit_match)

    def test_scan_of_something_else(self):
        self.add_landmarks()
        bpy.ops.exemplar.fit()
        self.assertFalse(self.mesh.exemplar_fit.is_doubtful, self.mesh.exemplar_fit.message)
        bpy.ops.mesh.primitive_torus_add(major_radius=3, minor_radius=0.4)
        torus = bpy.context.object
        addon_support.activate(self.mesh)
        self.mesh.exemplar_fit.scan = torus
        for limb, item in enumerate(self.mesh.exemplar_fit.landmarks):
            item.point = torus.data.vertices[100 * limb].co
        bpy.ops.exemplar.fit()
        self.assertTrue(self.mesh.exemplar_fit.is_doubtful, self.mesh.exemplar_fit.message)

    def test_cancelled_fit_changes_nothing(self):
        self.add_landmarks()
        gathered = inputs.gather(self.mesh, bpy.context.evaluated_depsgraph_get())
        self.assertFails("ancel", solving.fit, gathered, lambda fraction, stage: fraction > 0.5)
        self.assertIsNone(solving.Preview.points)
        self.assertEqual(len(self.mesh.data.shape_keys.key_blocks), 5)


if __name__ == "__main__":
    addon_support.run(globals())
