# SPDX-License-Identifier: GPL-3.0-or-later
"""Handles that come by themselves, and what is done with all of them at once."""

import os
import sys

import bpy
import numpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import SceneCase, bindings  # noqa: E402


def empties_of(obj):
    return [item.empty for item in obj.exemplar.handles]


def make_undoable(obj):
    """Background Blender has no undo until something is pushed."""
    support.activate(obj)
    bpy.ops.ed.undo_push(message="Start")


def lean(rest):
    """To +X, the more the higher."""
    return rest + numpy.column_stack([0.3 * rest[:, 2] ** 2, 0 * rest[:, 2], 0 * rest[:, 2]])


def make_cross(poses):
    """A flat cross of quads, symmetric in X: arms to both sides, one up, one down."""
    cells = [(x, 0) for x in range(-6, 7)] + [(0, z) for z in range(-6, 7) if z]
    corners = sorted({(x + a, z + b) for x, z in cells for a in (0, 1) for b in (0, 1)})
    index = {corner: i for i, corner in enumerate(corners)}
    places = numpy.array([(x - 0.5, 0.0, z - 0.5) for x, z in corners])
    faces = [[index[x + a, z + b] for a, b in ((0, 0), (1, 0), (1, 1), (0, 1))] for x, z in cells]
    return support.make_mesh("Cross", places, faces, poses), places


def raise_arms(rest):
    x, y, z = rest.T
    return numpy.column_stack([x, y + 0.2 * numpy.abs(x), z + 0.08 * x**2])


def raise_left(rest):
    x, y, z = rest.T
    return numpy.column_stack([x, y, z + 0.08 * numpy.maximum(x, 0) ** 2])


CROSS_POSES = {"Both": raise_arms, "Left": raise_left}


class QuickRig(SceneCase):
    def test_tips_of_a_cross(self):
        cross, places = make_cross(CROSS_POSES)
        self.assertEqual(bpy.ops.exemplar.quick_rig(), {"FINISHED"})
        centres = numpy.array([empty.location for empty in empties_of(cross)])
        for tip in ((6.0, 0, 0), (-6.0, 0, 0), (0, 0, 6.0), (0, 0, -6.0)):
            nearest = numpy.linalg.norm(centres - tip, axis=1).min()
            self.assertLess(nearest, 1.5, tip)
        names = [empty.name.split(".")[0] for empty in empties_of(cross)]
        self.assertEqual(names[0], "Root")
        self.assertEqual(names[1:5], ["Tip"] * 4)

    def test_it_binds_and_gives_every_exemplar_back(self):
        cross, places = make_cross(CROSS_POSES)
        bpy.ops.exemplar.quick_rig()
        bpy.ops.exemplar.bind()
        for name, pose in CROSS_POSES.items():
            bpy.ops.exemplar.pose_to_exemplar(name=name)
            self.assertClose(support.visible(cross), pose(places), 1e-3, name)

    def test_names_tell_the_sides(self):
        cross, _ = make_cross(CROSS_POSES)
        bpy.ops.exemplar.quick_rig()
        for empty in empties_of(cross):
            if abs(empty.location.x) > 2:
                side = ".L" if empty.location.x > 0 else ".R"
                self.assertIn(side, empty.name)

    def test_one_undo_takes_it_all_back(self):
        cross, _ = make_cross(CROSS_POSES)
        make_undoable(cross)
        bpy.ops.exemplar.quick_rig()
        bpy.ops.ed.undo_push(message="Quick Rig")
        self.assertGreater(len(bpy.data.objects), 4)
        bpy.ops.ed.undo()
        cross = bpy.data.objects["Cross"]
        self.assertEqual(len(cross.exemplar.handles), 0)
        self.assertEqual(len(cross.vertex_groups), 0)
        self.assertEqual(list(bpy.data.objects), [cross])

    def test_count(self):
        cross, _ = make_cross(CROSS_POSES)
        bpy.ops.exemplar.quick_rig(count=7, kind="ORIENTED")
        self.assertEqual(len(cross.exemplar.handles), 7)
        self.assertEqual({item.kind for item in cross.exemplar.handles}, {"ORIENTED"})

    def test_what_is_there_stays_and_is_not_doubled(self):
        cross, places = make_cross(CROSS_POSES)
        tip = numpy.flatnonzero(places[:, 0] > 6)
        mine = support.add_handle(cross, tip)
        bpy.ops.exemplar.quick_rig()
        self.assertEqual(cross.exemplar.handles[0].empty, mine)
        for empty in empties_of(cross)[1:]:
            self.assertGreater((empty.location - mine.location).length, 2)
        bpy.ops.exemplar.bind()

    def test_every_loose_part_is_held(self):
        places = support.bar_positions()
        both = numpy.concatenate([places, places + (3, 0, 0)])
        faces = support.bar_faces()
        faces += [[v + len(places) for v in face] for face in faces]
        bars = support.make_mesh("Bars", both, faces, {"Lean": lean})
        bpy.ops.exemplar.quick_rig()
        bpy.ops.exemplar.bind()
        self.assertTrue(bars.exemplar.bound)

    def test_without_exemplars_the_shape_decides(self):
        bare = support.make_mesh("Bare", support.bar_positions(), support.bar_faces(), {})
        support.activate(bare)
        bpy.ops.exemplar.quick_rig()
        heights = sorted(empty.location.z for empty in empties_of(bare))
        self.assertLess(heights[0], 0.2)
        self.assertGreater(heights[-1], support.HEIGHT - 0.2)

    def test_refusals(self):
        bare = support.make_mesh("Bare", support.bar_positions(), [], {})
        support.activate(bare)
        self.assertFails("no faces", bpy.ops.exemplar.quick_rig)
        cross, places = make_cross(CROSS_POSES)
        key = cross.data.shape_keys.key_blocks["Left"]
        key.data[3].co.z = float("nan")
        support.activate(cross)
        self.assertFails("not numbers", bpy.ops.exemplar.quick_rig)
        for obj in (bare, cross):
            self.assertEqual(len(obj.exemplar.handles), 0)
            self.assertEqual(len(obj.vertex_groups), 0)

    def test_a_creature(self):
        """A quadruped of the data: a handle at every foot, at the head and at the tail."""
        pack = numpy.load(support.data("lion.npz"))
        poses, faces = pack["poses"], pack["faces"]
        shapes = {f"Pose {i}": lambda _, i=i: poses[i] for i in range(1, len(poses))}
        lion = support.make_mesh("Lion", poses[0], faces.tolist(), shapes)
        support.activate(lion)
        bpy.ops.exemplar.quick_rig()
        centres = numpy.array([empty.location for empty in empties_of(lion)])
        size = numpy.linalg.norm(numpy.ptp(poses[0], axis=0))
        for name, tip in extremes(poses[0]).items():
            nearest = numpy.linalg.norm(centres - tip, axis=1).min()
            self.assertLess(nearest, 0.06 * size, name)
        bpy.ops.exemplar.bind()
        for name in ("Pose 3", "Pose 8"):
            bpy.ops.exemplar.pose_to_exemplar(name=name)
            error = numpy.abs(support.visible(lion) - support.key(lion, name)).max()
            self.assertLess(error, 1e-3 * size, name)


def extremes(rest):
    """Four feet, muzzle and tail of a quadruped that stands along Z, with Y up."""
    x, y, z = ((rest - rest.min(axis=0)) / numpy.ptp(rest, axis=0)).T
    low = numpy.flatnonzero(y < 0.1)
    found = {"muzzle": rest[z.argmax()], "tail": rest[z.argmin()]}
    for side, left in (("left", x[low] > 0.5), ("right", x[low] <= 0.5)):
        for end, front in (("front", z[low] > 0.55), ("hind", z[low] <= 0.55)):
            found[f"{side} {end}"] = rest[low[left & front]].mean(axis=0)
    return found


class Mirror(SceneCase):
    def test_the_other_side(self):
        cross, places = make_cross(CROSS_POSES)
        empty = support.add_handle(cross, numpy.flatnonzero(places[:, 0] > 6), "ORIENTED")
        empty.name = "Hand.L"
        cross.exemplar.handles[0].radius = 0.5
        bpy.ops.exemplar.handle_mirror()
        self.assertEqual(len(cross.exemplar.handles), 2)
        other = cross.exemplar.handles[1]
        self.assertEqual((other.empty.name, other.kind, other.radius), ("Hand.R", "ORIENTED", 0.5))
        self.assertClose(other.empty.location, (-6.5, 0, 0), 1e-5)
        bpy.ops.exemplar.handle_mirror()
        self.assertEqual(len(cross.exemplar.handles), 2, "a second time adds nothing")

    def test_the_middle_is_left_alone(self):
        cross, places = make_cross(CROSS_POSES)
        support.add_handle(cross, numpy.flatnonzero(places[:, 2] > 6))
        bpy.ops.exemplar.handle_mirror()
        self.assertEqual(len(cross.exemplar.handles), 1)

    def test_only_the_selected(self):
        cross, places = make_cross(CROSS_POSES)
        support.add_handle(cross, numpy.flatnonzero(places[:, 0] > 6))
        inner = support.add_handle(
            cross, numpy.flatnonzero((places[:, 0] > 3) & (places[:, 0] < 4))
        )
        support.activate(inner)
        bpy.ops.exemplar.handle_mirror()
        self.assertClose(cross.exemplar.handles[2].empty.location, (-3.5, 0, 0), 1e-5)
        self.assertEqual(len(cross.exemplar.handles), 3)

    def test_pose(self):
        cross, places = make_cross(CROSS_POSES)
        ends = [places[:, 0] > 6, places[:, 0] < -6, places[:, 2] > 6, places[:, 2] < -6]
        for end in ends:
            support.add_handle(cross, numpy.flatnonzero(end))
        bpy.ops.exemplar.bind()
        left, right, top, _ = empties_of(cross)
        left.location = (5, 1, 3)
        top.location.x += 1
        bpy.ops.exemplar.pose_mirror()
        self.assertClose(right.location, (-5, 1, 3), 1e-5)
        self.assertClose(left.location, (6.5, 0, 0), 1e-5)
        self.assertClose(top.location, (-1, 0, 6.5), 1e-5)
        before = support.solved(cross)
        bpy.ops.exemplar.pose_mirror()
        bpy.ops.exemplar.pose_mirror()
        self.assertClose(support.solved(cross), before, 1e-5)

    def test_pose_turns_too(self):
        cross, places = make_cross(CROSS_POSES)
        ends = [places[:, 0] > 6, places[:, 0] < -6, places[:, 2] < -6]
        for end in ends:
            support.add_handle(cross, numpy.flatnonzero(end), "ORIENTED")
        bpy.ops.exemplar.bind()
        left, right, _ = empties_of(cross)
        left.rotation_euler = (0.1, 0.4, 0.2)
        support.update()
        bpy.ops.exemplar.pose_mirror()
        self.assertClose(left.rotation_euler, (0, 0, 0), 1e-5)
        self.assertClose(right.rotation_euler, (0.1, -0.4, -0.2), 1e-5)

    def test_pose_without_a_pair(self):
        cross, places = make_cross(CROSS_POSES)
        for end in (places[:, 0] > 6, places[:, 2] < -6):
            support.add_handle(cross, numpy.flatnonzero(end))
        bpy.ops.exemplar.bind()
        empties_of(cross)[0].location.y = 2
        self.assertFails("no mirror image", bpy.ops.exemplar.pose_mirror)
        self.assertClose(empties_of(cross)[0].location, (6.5, 2, 0), 1e-6)


class Keys(SceneCase):
    def test_key_all(self):
        bar, empties = support.make_rig(kinds=("PINNED", "ORIENTED", "FREE"))
        empties[1].rotation_mode = "QUATERNION"
        self.scene.frame_set(7)
        bpy.ops.exemplar.key_all()
        self.assertEqual(keyed(empties[0]), {("location", 7.0)})
        self.assertEqual(
            keyed(empties[1]), {("location", 7.0), ("rotation_quaternion", 7.0), ("scale", 7.0)}
        )
        self.assertEqual(keyed(empties[2]), set(), "the mesh follows nothing of a free one")

    def test_keyed_poses_come_back(self):
        bar, empties = support.make_rig()
        shapes = {}
        for frame, place in ((1, (0.2, 0, 2.3)), (10, (0.6, 0.2, 2.1))):
            self.scene.frame_set(frame)
            empties[2].location = place
            support.update()
            bpy.ops.exemplar.key_all()
            shapes[frame] = support.solved(bar)
        for frame in (1, 10):
            self.scene.frame_set(frame)
            self.assertClose(support.visible(bar), shapes[frame], 1e-5)


def keyed(empty):
    """{(path, frame)}"""
    curves = support.versions.find_curves(empty) or ()
    return {(c.data_path, point.co.x) for c in curves for point in c.keyframe_points}


class ResultToKey(SceneCase):
    def test_it_holds_the_result(self):
        for target in ("KEY", "OBJECT"):
            bpy.ops.wm.read_factory_settings(use_empty=True)
            bar, empties = support.make_rig(bind=False)
            bar.exemplar.target = target
            bpy.ops.exemplar.bind()
            empties[2].location = (0.5, 0.1, 2.2)
            support.update()
            posed = support.solved(bar)
            before = support.artists_keys(bar)
            bpy.ops.exemplar.result_to_key(name="Found")
            self.assertClose(support.key(bar, "Found"), posed, 1e-6)
            self.assertEqual(bar.data.shape_keys.key_blocks["Found"].value, 0)
            self.assertClose(support.visible(bar), posed, 1e-5)
            after = support.artists_keys(bar)
            del after["Found"]
            self.assertEqual(after, before)

    def test_it_is_an_exemplar_from_the_next_bind_on(self):
        bar, empties = support.make_rig()
        empties[2].location = (0.5, 0.1, 2.2)
        support.update()
        bpy.ops.exemplar.result_to_key()
        self.assertEqual(support.problem(bar), "")
        bpy.ops.exemplar.rebind()
        bpy.ops.exemplar.pose_reset()
        bpy.ops.exemplar.pose_to_exemplar(name="Pose")
        self.assertClose(support.visible(bar), support.key(bar, "Pose"), 1e-4)
        self.assertEqual(bindings.state_of(bar).deformer.info.exemplar_count, 4)

    def test_undo(self):
        bar, _ = support.make_rig()
        make_undoable(bar)
        bpy.ops.exemplar.result_to_key()
        bpy.ops.ed.undo_push(message="Result to Shape Key")
        bpy.ops.ed.undo()
        self.assertNotIn("Pose", bpy.data.objects["Bar"].data.shape_keys.key_blocks)


if __name__ == "__main__":
    support.run(globals())
