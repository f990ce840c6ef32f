# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_rigidity_window.py: paint a mesh stiff, and pull it.

Prints "ok STEP" for each step that went well; screenshots go to the folder after `--`.
"""

import os
import sys

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import bindings  # noqa: E402
from blender_addon.scene import background, stiffness  # noqa: E402
from window_addon import Screen, check, close, done, open_tab, play, shown, wait_for  # noqa: E402


def story():
    screen = Screen()
    yield from set_the_stage(screen)
    bar = bpy.data.objects["Bar"]
    yield from bind(screen, bar)
    yield from drag(screen, bar)
    yield from paint(screen, bar)
    yield from fill(screen, bar)
    yield from heat(screen, bar)
    yield from undo(screen)
    yield from learn(screen)
    yield from escape(screen)


def set_the_stage(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        bar, _ = support.make_rig(bind=False, poses={})
        bpy.ops.view3d.view_axis(type="FRONT")
    yield 0.3
    with screen.override():
        screen.area.spaces.active.show_region_ui = True
        bpy.ops.view3d.view_all()
    yield 0.5
    yield from open_tab(screen)
    bar.exemplar.deformer = "RIGIDITY"
    yield 0.3
    screen.shoot("rigidity_1_ready")
    done("choose")


def bind(screen, bar):
    with screen.override():
        support.activate(bar)
        bpy.ops.exemplar.bind("INVOKE_DEFAULT")
    yield from wait_for(lambda: bar.exemplar.bound, "bound")
    yield 0.3
    check(close(shown(bar), support.bar_positions(), 1e-4), "at rest after Bind")
    bpy.ops.ed.undo_push(message="Bound")
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
        screen.move(start[0] + 14 * step, start[1] - 6 * step)
        yield 0.03
    yield from wait_for(lambda: not close(shown(bar), before, 1e-2), "the mesh follows the drag")
    screen.tap("LEFTMOUSE")
    yield from wait_for(lambda: bindings.state_of(bar).settled, "settled")
    yield 0.5
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
    screen.shoot("rigidity_2_dragged")
    done("drag")


def paint(screen, bar):
    """A stroke with the brush over the lower half."""
    with screen.override():
        support.activate(bar)
        bpy.ops.exemplar.rigidity_paint()
    check(bar.mode == "WEIGHT_PAINT", bar.mode)
    weights = bpy.context.scene.tool_settings.unified_paint_settings
    weights.use_unified_weight, weights.weight = True, 1.0
    weights.use_unified_size, weights.size = True, 40
    yield 0.5
    before, deformer = shown(bar), bindings.state_of(bar).deformer
    rest = stiffness.radii(bar)
    low, high = screen.place_of((0, -0.3, 0.1)), screen.place_of((0, -0.3, 1.0))
    screen.move(*low)
    yield 0.1
    x, y = screen.mouse
    screen.window.event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    yield 0.1
    for step in range(11):
        share = step / 10
        screen.move(*(a + share * (b - a) for a, b in zip(low, high)))
        yield 0.05
    x, y = screen.mouse
    screen.window.event_simulate("LEFTMOUSE", "RELEASE", x=x, y=y)
    yield from wait_for(lambda: (stiffness.radii(bar) > rest).sum() > 5, "the brush paints")
    yield from wait_for(
        lambda: (bindings.state_of(bar).deformer.radii() == stiffness.radii(bar)).all(),
        "what was painted is taken up",
    )
    yield from wait_for(lambda: not close(shown(bar), before, 1e-4), "the mesh shows it")
    check(bindings.state_of(bar).deformer is deformer, "without a full bind")
    yield 0.5
    screen.shoot("rigidity_3_painted")
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
        bpy.ops.exemplar.rigidity_paint()
    check(bar.mode == "OBJECT", bar.mode)
    done("paint")


def fill(screen, bar):
    with screen.override():
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="DESELECT")
        bpy.ops.object.mode_set(mode="OBJECT")
        support.select(bar, support.level(10) + support.level(11))
        bpy.ops.object.mode_set(mode="EDIT")
    yield 0.3
    bar.exemplar.rigidity.fill_value = 0.6
    with screen.override():
        bpy.ops.exemplar.rigidity_fill("INVOKE_DEFAULT")
    yield 0.3
    screen.shoot("rigidity_4_fill")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield from wait_for(
        lambda: set(bindings.state_of(bar).deformer.radii()[support.level(11)]) == {4},
        "the filled vertices have what Fill says",
    )
    done("fill")


def heat(screen, bar):
    bar.exemplar.rigidity.show_radii = True
    with screen.override():
        bpy.ops.object.select_all(action="DESELECT")
        bpy.context.view_layer.objects.active = bar
    yield 0.5
    screen.shoot("rigidity_5_colours")
    check(pixel_colours(screen, bar), "the mesh is coloured")
    done("colours")


def pixel_colours(screen, bar):
    """Whether light blue (nearly softest) and red (stiffest) are to be seen over the mesh."""
    path = os.path.join(sys.argv[sys.argv.index("--") + 1], "rigidity_5_colours.png")
    image = bpy.data.images.load(path)
    pixels = support.numpy.array(image.pixels).reshape(-1, 4)
    bpy.data.images.remove(image)
    red = (pixels[:, 0] > 0.6) & (pixels[:, 1] < 0.4) & (pixels[:, 2] < 0.4)
    blue = (pixels[:, 2] > 0.8) & (pixels[:, 0] < 0.45)
    return red.sum() > 300 and blue.sum() > 300


def undo(screen):
    """Back to before the drag, and to where we were."""
    radii = bindings.state_of(bpy.data.objects["Bar"]).deformer.radii()
    with screen.override():
        bpy.ops.ed.undo_push(message="Here")
        while bpy.data.objects["Bar"].exemplar.rigidity.source == "PAINTED":
            bpy.ops.ed.undo()
    yield 0.5
    bar = bpy.data.objects["Bar"]
    bindings.ensure(bar)
    check(set(bindings.state_of(bar).deformer.radii()) == {2}, "uniform again")
    with screen.override():
        while bpy.ops.ed.redo.poll():
            bpy.ops.ed.redo()
    yield 0.5
    bar = bpy.data.objects["Bar"]
    bindings.ensure(bar)
    check((bindings.state_of(bar).deformer.radii() == radii).all(), "painted again")
    done("undo")


def learn(screen):
    """From another object's animation, in the window."""
    bar = bpy.data.objects["Bar"]
    with screen.override():
        actor = support.make_bar("Actor", poses={"Bend": support.pose_bend})
        actor.location.x = 3
        key = actor.data.shape_keys.key_blocks["Bend"]
        for frame, value in ((1, 0), (20, 1)):
            key.value = value
            key.keyframe_insert("value", frame=frame)
        scene = bpy.context.scene
        scene.frame_start, scene.frame_end = 1, 20
        scene.frame_set(3)
        bar.exemplar.rigidity.animated = actor
        bar.exemplar.rigidity.omega = 0.05
        support.activate(bar)
        before = stiffness.radii(bar)
        bpy.ops.exemplar.rigidity_learn_animation("INVOKE_DEFAULT")
    yield from wait_for(
        lambda: not (stiffness.radii(bar) == before).all() and not background.running(), "learned"
    )
    yield 0.5
    check(scene.frame_current == 3, "back on its frame")
    screen.shoot("rigidity_6_learned")
    check((bindings.state_of(bar).deformer.radii() == stiffness.radii(bar)).all(), "in use")
    done("learn")


def escape(screen):
    """Esc among the frames: nothing has changed."""
    bar, scene = bpy.data.objects["Bar"], bpy.context.scene
    before = stiffness.radii(bar)
    bar.exemplar.rigidity.omega = 0.8
    scene.frame_end = 3000
    with screen.override():
        bpy.ops.exemplar.rigidity_learn_animation("INVOKE_DEFAULT")
    yield 0.4
    screen.tap("ESC")
    yield from wait_for(lambda: scene.frame_current == 3, "back on its frame")
    yield 0.3
    check(not background.running(), "no thread is left")
    check((stiffness.radii(bar) == before).all(), "as before")
    done("escape")


if __name__ == "__main__":
    play(story())
