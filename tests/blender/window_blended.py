# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_blended_window.py: choose Blended, bind, drag, interpolate, weights.

Prints "ok STEP" for each step that went well; screenshots go to the folder after `--`.
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import bindings  # noqa: E402
from blender_addon.scene import background, interpolation, status  # noqa: E402
from window_addon import Screen, check, close, done, open_tab, play, shown, wait_for  # noqa: E402


def story():
    screen = Screen()
    yield from set_the_stage(screen)
    bar = bpy.data.objects["Bar"]
    yield from bind(screen, bar)
    yield from drag(screen, bar)
    yield from interpolate(screen, bar)
    yield from skin(screen, bar)
    yield from switch(screen, bar)


def set_the_stage(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        bar, _ = support.make_rig(bind=False)
        bpy.ops.view3d.view_axis(type="FRONT")
    yield 0.3
    with screen.override():
        screen.area.spaces.active.show_region_ui = True
        bpy.ops.view3d.view_all()
    yield 0.5
    yield from open_tab(screen)
    bar.exemplar.deformer = "BLENDED"
    bar.exemplar.blended.dictionary = "SKELETON"
    bar.exemplar.blended.bones = 2
    yield 0.3
    done("choose")


def bind(screen, bar):
    with screen.override():
        support.activate(bar)
        bpy.ops.exemplar.bind("INVOKE_DEFAULT")
    yield from wait_for(lambda: bar.exemplar.bound, "bound")
    yield 0.3
    screen.shoot("blended_1_bound")
    check(status.pending(bar) == "", status.pending(bar))
    done("bind")


def drag(screen, bar):
    empty = bar.exemplar.handles[2].empty
    with screen.override():
        support.activate(empty)
    before = shown(bar)
    start = screen.place_of(empty.matrix_world.translation)
    screen.move(*start)
    yield 0.1
    screen.tap("G")
    yield 0.1
    for step in range(1, 11):
        screen.move(start[0] + 12 * step, start[1] - 6 * step)
        yield 0.03
    yield from wait_for(lambda: not close(shown(bar), before, 1e-2), "the mesh follows the drag")
    screen.tap("LEFTMOUSE")
    yield from wait_for(lambda: bindings.state_of(bar).settled, "settled")
    yield 0.5
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
    screen.shoot("blended_2_dragged")
    done("drag")


def interpolate(screen, bar):
    scene = bpy.context.scene
    with screen.override():
        support.activate(bar)
        scene.frame_set(20)
        bpy.ops.exemplar.key_all()
        scene.frame_set(1)
        bpy.ops.exemplar.pose_reset()
        bpy.ops.exemplar.key_all()
        scene.frame_set(10)
        bpy.ops.exemplar.interpolate("INVOKE_DEFAULT")
    yield from wait_for(lambda: len(interpolation.keyed_frames(bar)) == 20, "keyed")
    yield 0.5
    check(not background.running(), "no thread is left")
    check(scene.frame_current == 10, "back on its frame")
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
    screen.shoot("blended_3_interpolated")
    done("interpolate")


def skin(screen, bar):
    with screen.override():
        support.activate(bar)
        bpy.ops.exemplar.skin_to_groups()
        bar.vertex_groups.active = bar.vertex_groups["Bone.001"]
        bpy.ops.object.mode_set(mode="WEIGHT_PAINT")
    yield 0.5
    screen.shoot("blended_4_weights")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    check(support.problem(bar) == "", support.problem(bar))
    done("skin")


def switch(screen, bar):
    """Another deformer waits for Rebind, and says so."""
    before = shown(bar)
    bar.exemplar.deformer = "AMRAP"
    yield 0.5
    check(close(shown(bar), before), "as before")
    texts = [line.text for line in status.describe(bar)]
    check("Press Rebind to use the changed deformer." in texts, texts)
    screen.shoot("blended_5_pending")
    with screen.override():
        bpy.ops.exemplar.rebind("INVOKE_DEFAULT")
    yield from wait_for(lambda: status.pending(bar) == "", "rebound")
    yield 0.3
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
    done("switch")


if __name__ == "__main__":
    play(story())
