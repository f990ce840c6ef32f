# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_sequence_window.py: a sequence edited by mouse and keys.

Prints "ok STEP" for each step that went well; screenshots go to the folder after `--`.
"""

import os
import sys

import bpy
import numpy
from mathutils import Vector

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import sequence_support  # noqa: E402
from blender_addon.scene import background  # noqa: E402
from blender_addon.scene.sequences import live, retiming, store  # noqa: E402
from blender_addon.ui import pose_space  # noqa: E402
from window_addon import Screen, check, done, play, wait_for  # noqa: E402

FIRST, LAST = sequence_support.FIRST, sequence_support.LAST


def owner():
    """Undo replaces objects, so they are looked up each time."""
    return bpy.data.objects["Bar Sequence"]


def seen():
    return support.versions.get_mesh_positions(owner().data)


def story():
    screen = Screen()
    yield from capture(screen)
    yield from shapes_are_drawn(screen)
    yield from drag_point(screen)
    yield from undo_in_edit_mode(screen)
    yield from drag_mark(screen)
    yield from undo_of_mark(screen)
    yield from playhead(screen)
    yield from retime(screen)
    yield from escape(screen)


def capture(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        bar = sequence_support.make_animated()
        support.activate(bar)
        screen.area.spaces.active.show_region_ui = True
    yield 0.5
    screen.shoot("sequence_0_start")
    with screen.override():
        bpy.ops.exemplar.sequence_capture("INVOKE_DEFAULT", fidelity="EXACT")
    yield from wait_for(lambda: "Bar Sequence" in bpy.data.objects, "captured")
    yield 0.3
    with screen.override():
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_all()
    yield 0.5
    done("capture")


def drawn():
    return pose_space._cache.get("Bar Sequence")


def shapes_are_drawn(screen):
    yield from wait_for(lambda: drawn() is not None and drawn().shapes is not None, "drawn")
    yield from open_sequence_tab(screen)
    yield 0.5
    screen.shoot("sequence_1_captured")
    # A processor that draws has enough to do with fewer.
    owner().exemplar_sequence.shape_count = 6
    done("shapes_are_drawn")


def open_sequence_tab(screen):
    """open_tab watches the panel of deformers, which hides while a sequence is active."""
    with screen.override():
        support.activate(bpy.data.objects["Bar Sequence"])
    panel = bpy.types.EXEMPLAR_PT_sequence
    original, opened = panel.draw, []

    def watch(self, context):
        opened.append(True)
        original(self, context)

    panel.draw = watch
    sidebar = screen.region("UI")
    for y in range(sidebar.y + sidebar.height - 20, sidebar.y, -25):
        screen.move(sidebar.x + sidebar.width - 8, y)
        screen.tap("LEFTMOUSE")
        yield 0.15
        if opened:
            break
    panel.draw = original
    check(opened, "the tab Exemplar was not found")


def edit(screen, obj, index):
    """Edit Mode of a part of the pose space, seen from above, one vertex selected."""
    with screen.override():
        support.activate(obj)
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
    yield 0.2
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.data.vertices[index].select = True
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.tool_settings.mesh_select_mode = (True, False, False)
        # What Tab does for a hand.
        bpy.ops.ed.undo_push(message="Toggle Edit Mode")
        bpy.ops.view3d.view_selected()
        bpy.ops.view3d.zoom(delta=-4)
    yield 0.4


def drag(screen, obj, index, way):
    start = screen.place_of(obj.matrix_world @ Vector(obj.data.vertices[index].co))
    screen.move(*start)
    yield 0.1
    screen.tap("G")
    yield 0.1
    for step in range(1, 11):
        screen.move(start[0] + way[0] * step / 10, start[1] + way[1] * step / 10)
        yield 0.04


def drag_point(screen):
    scene = screen.window.scene
    scene.frame_set(7)
    yield 0.2
    curve = owner().exemplar_sequence.curve
    yield from edit(screen, curve, 7)
    before = seen()
    yield from drag(screen, curve, 7, (70, 50))
    yield from wait_for(lambda: abs(seen() - before).max() > 0.02, "the character follows at once")
    yield 0.2
    screen.shoot("sequence_2_dragged")
    screen.tap("LEFTMOUSE")
    yield 0.5
    updates = store.shown(owner()).updates
    yield 0.5
    check(store.shown(owner()).updates == updates, "a still scene evaluates nothing")
    yield from wait_for(lambda: not live._waiting, "packed when the hand is still")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    done("drag_point")


def undo_in_edit_mode(screen):
    """Subdivide with Blender's own tool, take it back: the very same animation as before."""
    curve = owner().exemplar_sequence.curve
    with screen.override():
        support.activate(curve)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
    yield 0.3
    state = store.peek(owner())
    count = state.sequence.window().control_point_count
    knots, before = state.sequence.knots(), seen()
    with screen.override():
        bpy.ops.mesh.subdivide("EXEC_DEFAULT", True)

    def points():
        return store.peek(owner()).sequence.window().control_point_count

    yield from wait_for(lambda: points() == 2 * count - 1, "as many control points as vertices")
    yield 0.3
    with screen.override():
        bpy.ops.ed.undo()
    yield from wait_for(lambda: points() == count, "undo takes them away")
    yield 0.3
    sequence = store.peek(owner()).sequence
    check(numpy.array_equal(sequence.knots(), knots), "the very same knots")
    check(abs(seen() - before).max() < 1e-6, "and the same shape")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    done("undo_in_edit_mode")


def marks():
    obj = owner().exemplar_sequence.marks
    if obj.mode == "EDIT":
        obj.update_from_editmode()
    return numpy.array([vertex.co[:2] for vertex in obj.data.vertices])


def drag_mark(screen):
    obj = owner().exemplar_sequence.marks
    yield from edit(screen, obj, 5)
    before = marks()
    yield from drag(screen, obj, 5, (90, -60))
    yield 0.3
    there = marks()
    moved = numpy.linalg.norm(there - before, axis=1)
    check(moved[5] > 0.02, f"the mark follows the hand: {moved}")
    others = numpy.delete(moved, 5)
    check(others.max() > 1e-4, f"the others relax while it is dragged: {moved}")
    screen.shoot("sequence_3_mark")
    screen.tap("LEFTMOUSE")
    yield from wait_for(lambda: not live._waiting, "settled")
    yield 0.3
    state = store.peek(owner())
    check(state.problem is None, str(state.problem))
    check(numpy.abs(marks()[5] - there[5]).max() < 1e-6, "the mark stays where it was put")
    settled = numpy.float32(state.sequence.marks()[0])
    check(numpy.abs(marks() - settled).max() < 1e-5, "the marks are those of the sequence")
    done("drag_mark")


def undo_of_mark(screen):
    after = marks()
    with screen.override():
        bpy.ops.ed.undo()
    yield from wait_for(lambda: abs(marks()[5] - after[5]).max() > 0.02, "undo moves it back")
    yield 0.5
    state = store.peek(owner())
    check(state.problem is None, str(state.problem))
    settled = numpy.float32(state.sequence.marks()[0])
    check(numpy.abs(marks() - settled).max() < 1e-5, "the sequence has gone back with it")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    check(store.peek(owner()).problem is None, str(store.peek(owner()).problem))
    done("undo_of_mark")


def playhead(screen):
    data = owner().exemplar_sequence
    data.follow = "PLAYHEAD"
    head = data.playhead
    with screen.override():
        support.activate(head)
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_all()
    yield 0.4
    before = seen()
    start = screen.place_of(head.matrix_world.translation)
    screen.move(*start)
    yield 0.1
    screen.tap("G")
    yield 0.1
    for step in range(1, 11):
        screen.move(start[0] + 9 * step, start[1] + 6 * step)
        yield 0.04
    yield from wait_for(lambda: abs(seen() - before).max() > 0.02, "the playhead poses")
    screen.tap("LEFTMOUSE")
    yield 0.4
    with screen.override():
        bpy.ops.view3d.view_orbit(angle=0.4, type="ORBITLEFT")
        bpy.ops.view3d.view_all()
    yield 0.6
    screen.shoot("sequence_4_playhead")
    point = tuple(head.location[:2])
    expected = store.peek(owner()).sequence.pose(point)
    check(abs(seen() - expected).max() < 1e-4, "where the playhead is")
    owner().exemplar_sequence.follow = "TIME"
    yield 0.2
    done("playhead")


def retime(screen):
    """The curve in the Graph Editor."""
    with screen.override():
        support.activate(owner())
    area = next(a for a in screen.window.screen.areas if a.type == "DOPESHEET_EDITOR")
    area.type = "GRAPH_EDITOR"
    yield 0.4
    curve = retiming.curve_of(owner())
    curve.keyframe_points.insert(8, 12.0)
    curve.update()
    for frame in (4, 8, 12):
        with screen.override():
            screen.window.scene.frame_set(frame)
        yield 0.2
        time = curve.evaluate(frame) - 1
        expected = store.peek(owner()).sequence.evaluate(time)
        check(abs(seen() - expected).max() < 1e-5, f"frame {frame} shows {time + 1}")
    yield 0.3
    screen.shoot("sequence_5_retimed")
    done("retime")


def escape(screen):
    """Esc while frames are captured leaves everything as it was."""
    with screen.override():
        bar = sequence_support.make_animated("Long")
        support.activate(bar)
    scene = screen.window.scene
    scene.frame_set(3)
    before = len(bpy.data.objects), len(bpy.data.texts)
    with screen.override():
        bpy.ops.exemplar.sequence_capture(
            "INVOKE_DEFAULT", use_scene_range=False, frame_start=1, frame_end=100000
        )
    yield from wait_for(lambda: scene.frame_current > 20, "it runs")
    screen.shoot("sequence_6_capturing")
    screen.tap("ESC")
    yield from wait_for(lambda: scene.frame_current == 3, "back on its frame")
    yield 0.3
    check((len(bpy.data.objects), len(bpy.data.texts)) == before, "as before")
    check(not background.running(), "no thread is left")
    done("escape")


if __name__ == "__main__":
    play(story())
