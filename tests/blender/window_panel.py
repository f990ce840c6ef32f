# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_panel_window.py: the work from top to bottom, by clicks.

A button is found by asking Blender: Ctrl C over it copies the command that it runs.
"""

import os
import sys
import tempfile

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import window_addon as window  # noqa: E402
from window_addon import check, done, open_tab, wait_for  # noqa: E402

PAUSE = 0.03
# About how far below the top of the sidebar the buttons are, in pixels.
HINTS = {
    "exemplar.handle_add": 380,
    "exemplar.bind": 565,
    "exemplar.pose_reset": 795,
    "exemplar.key_all": 842,
}


class Panel(window.Screen):
    """The sidebar with our tab open."""

    def __init__(self):
        super().__init__()
        self.found = (0, 0)

    def find(self, command, hint):
        """The pixel of the button that runs `command`, looked for from `hint` pixels below the top
        of the sidebar, up and down: each look has the whole window drawn."""
        manager = bpy.context.window_manager
        sidebar = self.region("UI")
        x, top = sidebar.x + int(0.42 * sidebar.width), sidebar.y + sidebar.height
        seen = set()
        for step in range(24):
            y = top - hint - 8 * (step // 2 + step % 2) * (-1) ** step
            if not sidebar.y + 4 < y < top - 30:
                continue
            manager.clipboard = ""
            self.move(x, y)
            yield PAUSE
            self.tap("C", ctrl=True)
            yield PAUSE
            seen.add(manager.clipboard)
            if command in manager.clipboard:
                self.found = (x, y)
                return
        raise AssertionError(f"no button for {command}; there are {sorted(seen)}")

    def click(self, command):
        yield from self.find(command, HINTS[command])
        yield PAUSE
        self.tap("LEFTMOUSE")
        yield 0.3


def story():
    panel = Panel()
    yield from set_the_stage(panel)
    yield from add_handles(panel)
    yield from bind(panel)
    yield from pose(panel)
    yield from bake(panel)


def set_the_stage(panel):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    yield from make_bar(panel)
    with panel.override():
        panel.area.spaces.active.show_region_ui = True
        bpy.ops.view3d.view_axis(type="FRONT")
        bpy.ops.view3d.view_all()
    yield 0.5
    yield from open_tab(panel)


def make_bar(panel):
    with panel.override():
        bar = support.make_bar()
        support.activate(bar)
        bpy.ops.ed.undo_push(message="Bar")
    yield 0.4


def bar():
    """Undo replaces objects, so it is looked up each time."""
    return bpy.data.objects["Bar"]


def add_handles(panel):
    """In Edit Mode, from selections; the buttons stay where they are as the list fills."""
    with panel.override():
        bpy.ops.object.mode_set(mode="EDIT")
    yield 0.3
    panel.shoot("panel_wide_1_edit_mode")
    for count, ring in enumerate(support.LEVELS.values(), 1):
        select_in_edit_mode(panel, support.level(ring))
        yield 0.2
        yield from panel.click("exemplar.handle_add")
        yield from wait_for(lambda: len(bar().exemplar.handles) == count, f"{count} handles")
    with panel.override():
        bpy.ops.object.mode_set(mode="OBJECT")
    yield 0.3
    centres = [item.empty.location.z for item in bar().exemplar.handles]
    heights = [support.HEIGHT * ring / 12 for ring in support.LEVELS.values()]
    check(window.close(support.numpy.array(centres), support.numpy.array(heights)), "at the rings")
    panel.shoot("panel_wide_2_handles")
    done("add")


def select_in_edit_mode(panel, vertices):
    with panel.override():
        bpy.ops.object.mode_set(mode="OBJECT")
        support.select(bar(), vertices)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.context.tool_settings.mesh_select_mode = (True, False, False)


def bind(panel):
    yield from panel.click("exemplar.bind")
    yield from wait_for(lambda: bar().exemplar.bound, "bound", 120)
    yield 0.3
    check(window.close(window.shown(bar()), support.bar_positions(), 1e-4), "at rest after Bind")
    panel.shoot("panel_wide_3_bound")
    done("bind")


def pose(panel):
    """Drag an empty, undo, redo, reset, key: and look at the mesh each time."""
    yield from window.drag(panel, bar())
    posed = window.shown(bar())
    with panel.override():
        bpy.ops.ed.undo()
    yield from wait_for(lambda: window.shows(support.bar_positions(), 1e-4), "undo")
    with panel.override():
        bpy.ops.ed.redo()
    yield from wait_for(lambda: window.shows(posed, 1e-5), "redo")
    panel.shoot("panel_wide_4_posed")
    yield from panel.click("exemplar.pose_reset")
    yield from wait_for(lambda: window.shows(support.bar_positions(), 1e-4), "Reset Pose")
    yield from panel.click("exemplar.key_all")
    empty = bar().exemplar.handles[0].empty
    yield from wait_for(lambda: support.versions.find_curves(empty), "Key All Handles")
    done("pose")


def bake(panel):
    with tempfile.TemporaryDirectory() as folder:
        with panel.override():
            bpy.ops.exemplar.bake(format="PC2", filepath=os.path.join(folder, "a.pc2"))
        check(bar().modifiers, "baked")
        with panel.override():
            bpy.ops.exemplar.bake_remove()
    yield 0.2
    done("bake")


if __name__ == "__main__":
    window.play(story())
