# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_addon_window.py: what an artist does, by mouse and keys.

Prints "ok STEP" for each step that went well; screenshots go to the folder after `--`.
"""

import os
import sys
import time
import traceback

import bpy
from bpy_extras.view3d_utils import location_3d_to_region_2d

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
from addon_support import bindings  # noqa: E402
from blender_addon.scene import background, status  # noqa: E402

FOLDER = sys.argv[sys.argv.index("--") + 1]


class Screen:
    """The window, its 3D view, and a hand."""

    def __init__(self):
        self.window = bpy.context.window_manager.windows[0]
        self.area = next(a for a in self.window.screen.areas if a.type == "VIEW_3D")
        self.mouse = (0, 0)

    def region(self, kind="WINDOW"):
        return next(r for r in self.area.regions if r.type == kind)

    def override(self):
        return bpy.context.temp_override(
            window=self.window, area=self.area, region=self.region(), screen=self.window.screen
        )

    def move(self, x, y):
        self.mouse = (int(x), int(y))
        self.window.event_simulate("MOUSEMOVE", "NOTHING", x=self.mouse[0], y=self.mouse[1])

    def tap(self, key, **modifiers):
        for value in ("PRESS", "RELEASE"):
            x, y = self.mouse
            self.window.event_simulate(key, value, x=x, y=y, **modifiers)

    def place_of(self, location):
        """Pixel of the window where a point of the world is seen."""
        space = self.area.spaces.active
        at = location_3d_to_region_2d(self.region(), space.region_3d, location)
        return self.region().x + at.x, self.region().y + at.y

    def shoot(self, name):
        with self.override():
            bpy.ops.screen.screenshot(filepath=os.path.join(FOLDER, f"{name}.png"))


def play(steps):
    """Run a generator in the event loop; what it yields are the seconds until it goes on."""

    def tick():
        try:
            return next(steps)
        except StopIteration:
            print("end", flush=True)
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            sys.stdout.flush()
            os._exit(1)

    bpy.app.timers.register(tick, first_interval=0.5)


def done(name):
    print("ok", name, flush=True)


def wait_for(what, text, seconds=60):
    """A machine with other work to do takes its time."""
    until = time.monotonic() + seconds
    while not what():
        check(time.monotonic() < until, f"waited in vain: {text}")
        yield 0.05


def check(condition, text):
    if not condition:
        raise AssertionError(text)


def shown(bar):
    return support.key(bar, "Exemplar Result")


def shows(positions, tolerance):
    """Undo replaces objects, so they are looked up each time."""
    return close(shown(bpy.data.objects["Bar"]), positions, tolerance)


def close(first, second, tolerance=1e-5):
    return abs(first - second).max() <= tolerance


# ------------------------------------------------------------------------------------------ story


def story():
    screen = Screen()
    yield from set_the_stage(screen)
    bar = bpy.data.objects["Bar"]
    yield from bind(screen, bar)
    yield from drag(screen, bar)
    yield from undo_and_redo(screen)
    yield from edit_mode(screen)
    yield from playback(screen)
    yield from escape(screen)
    yield from render(screen)
    yield from deleted_empty(screen)


def set_the_stage(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        support.make_rig(bind=False)
        bpy.ops.view3d.view_axis(type="FRONT")
    yield 0.3
    with screen.override():
        screen.area.spaces.active.show_region_ui = True
        bpy.ops.view3d.view_all()
    yield 0.5
    yield from open_tab(screen)
    screen.shoot("1_ready")
    done("open")


def open_tab(screen):
    """Click down the tabs at the sidebar's right edge until ours is open."""
    sidebar = screen.region("UI")
    drawn = []
    original = bpy.types.EXEMPLAR_PT_main.draw

    def watch(self, context):
        drawn.append(True)
        original(self, context)

    bpy.types.EXEMPLAR_PT_main.draw = watch
    for y in range(sidebar.y + sidebar.height - 20, sidebar.y, -25):
        screen.move(sidebar.x + sidebar.width - 8, y)
        screen.tap("LEFTMOUSE")
        yield 0.15
        if drawn:
            break
    bpy.types.EXEMPLAR_PT_main.draw = original
    check(drawn, "the tab Exemplar was not found")


def bind(screen, bar):
    with screen.override():
        bpy.ops.exemplar.bind("INVOKE_DEFAULT")
    yield from wait_for(lambda: bar.exemplar.bound, "bound")
    yield 0.3
    check(close(shown(bar), support.bar_positions(), 1e-4), "at rest after Bind")
    screen.shoot("2_bound")
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
        screen.move(start[0] + 12 * step, start[1] - 4 * step)
        yield 0.03
    yield from wait_for(lambda: not close(shown(bar), before, 1e-2), "the mesh follows the drag")
    yield 0.5
    screen.shoot("3_dragged")
    screen.tap("LEFTMOUSE")
    yield from wait_for(lambda: bindings.state_of(bar).settled, "settled")
    yield 0.5
    with screen.override():
        check(close(shown(bar), support.solved(bar)), "shows what renders show")
    solves = bindings.state_of(bar).solves
    yield 0.5
    check(bindings.state_of(bar).solves == solves, "a still scene solves nothing")
    check(not bindings.state_of(bar).verify_later, "our own writes are not taken for edits")
    done("drag")


def undo_and_redo(screen):
    bar = bpy.data.objects["Bar"]
    posed = shown(bar)
    with screen.override():
        bpy.ops.ed.undo()
    yield from wait_for(lambda: shows(support.bar_positions(), 1e-4), "undo shows the rest")
    with screen.override():
        bpy.ops.ed.redo()
    yield from wait_for(lambda: shows(posed, 1e-5), "redo shows the pose")
    done("undo")


def edit_mode(screen):
    bar = bpy.data.objects["Bar"]
    with screen.override():
        support.activate(bar)
        bpy.ops.object.mode_set(mode="EDIT")
    yield 0.4
    screen.shoot("4_edit_mode")
    with screen.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.4
    check(support.problem(bar) == "", support.problem(bar))
    done("edit_mode")


def playback(screen):
    bar = bpy.data.objects["Bar"]
    scene = screen.window.scene
    empty = bar.exemplar.handles[2].empty
    empty.keyframe_insert("location", frame=1)
    empty.location = (0, 0.4, 2.2)
    empty.keyframe_insert("location", frame=20)
    scene.frame_start, scene.frame_end = 1, 20
    scene.frame_set(1)
    yield 0.2
    # Playback itself hardly advances where a processor draws the window.
    for _ in range(8):
        check(not bindings.state_of(bar).verify_later, "our own writes are not taken for edits")
        with screen.override():
            bpy.ops.screen.frame_offset(delta=2)
        yield 0.1
        with screen.override():
            expected = support.solved(bar)
        yield from wait_for(lambda: shows(expected, 1e-5), "each frame shows what renders show")
    check(scene.frame_current > 10, "frames advance")
    check(not bindings.state_of(bar).verify_later, "nothing waits")
    done("playback")


def render(screen):
    """A render in its own thread, with motion blur, while the window is open."""
    bar = bpy.data.objects["Bar"]
    scene = screen.window.scene
    support.small_render(scene)
    scene.render.use_motion_blur = True
    scene.render.filepath = os.path.join(FOLDER, "frame_")
    scene.frame_start, scene.frame_end, scene.frame_step = 2, 6, 2
    bpy.context.preferences.view.render_display_type = "NONE"
    finished = []
    bpy.app.handlers.render_complete.append(lambda *_: finished.append(True))
    scene.frame_set(9)
    before = shown(bar)
    with screen.override():
        bpy.ops.render.render("INVOKE_DEFAULT", animation=True)
    yield from wait_for(lambda: finished and not bpy.app.is_job_running("RENDER"), "rendered")
    yield 0.5
    check(scene.frame_current == 9, f"back on frame 9, not {scene.frame_current}")
    check(close(shown(bar), before), "shows the frame that it showed before the render")
    scene.frame_step = 1
    done("render")


def deleted_empty(screen):
    bar = bpy.data.objects["Bar"]
    with screen.override():
        support.activate(bar)
    bpy.data.objects.remove(bar.exemplar.handles[1].empty)
    yield 0.3
    check("deleted" in status.describe(bar)[0].text, "the status line says what is missing")
    screen.shoot("5_deleted_empty")
    done("deleted_empty")


def escape(screen):
    """Esc ends a bind that takes long, with everything as before."""
    count = 200
    places = [(x / count, y / count, 0) for y in range(count) for x in range(count)]
    corners = [y * count + x for y in range(count - 1) for x in range(count - 1)]
    faces = [(c, c + 1, c + count + 1, c + count) for c in corners]
    with screen.override():
        sheet = support.make_mesh(
            "Sheet", support.numpy.array(places), faces, {"Wide": lambda p: p * (2, 1, 1)}
        )
        for start in (0, 100 * count, 199 * count):
            support.add_handle(sheet, [start, start + 1])
        before = (len(bpy.data.objects), list(sheet.data.shape_keys.key_blocks.keys()))
        bpy.ops.exemplar.bind("INVOKE_DEFAULT")
    yield 0.2
    screen.shoot("6_binding")
    screen.tap("ESC")
    yield from wait_for(lambda: not background.running(), "the thread ends")
    yield 0.2
    check(not sheet.exemplar.bound, "not bound")
    after = (len(bpy.data.objects), list(sheet.data.shape_keys.key_blocks.keys()))
    check(after == before, "as before")
    done("escape")


if __name__ == "__main__":
    play(story())
