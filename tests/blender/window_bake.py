# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_bake_window.py. Prints "ok STEP" for each step that went well."""

import importlib
import os
import sys
import tempfile
from pathlib import Path

import bpy

sys.path.insert(0, os.path.dirname(__file__))
import bake_support  # noqa: E402
from bake_support import FIRST, LAST  # noqa: E402
from window_addon import Screen, check, done, open_tab, play, wait_for  # noqa: E402

FOLDER = Path(tempfile.mkdtemp())
TARGET = FOLDER / "bar.pc2"


def addon(path):
    return importlib.import_module(f"blender_addon.{path}")


def story():
    screen = Screen()
    yield from panel(screen)
    yield from escape(screen)
    yield from bake(screen)
    yield from undo(screen)
    yield from another_file(screen)


def panel(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        bake_support.make_bar(addon)
        bpy.ops.view3d.view_axis(type="FRONT")
        screen.area.spaces.active.show_region_ui = True
    # Open, for the picture, and the sections above it shut.
    bpy.utils.unregister_class(bpy.types.EXEMPLAR_PT_bake)
    section = addon("ui.bake").EXEMPLAR_PT_bake
    section.bl_options, section.bl_order = set(), 0
    bpy.utils.register_class(section)
    yield 0.3
    with screen.override():
        bpy.ops.view3d.view_all()
    yield 0.3
    yield from open_tab(screen)
    yield 0.3
    screen.shoot("bake_1_panel")
    done("panel")


def start(screen, end):
    bar = bpy.data.objects["Bar"]
    settings = bar.exemplar_bake
    settings.filepath = str(TARGET)
    settings.use_scene_range, settings.frame_start, settings.frame_end = False, FIRST, end
    with screen.override():
        bpy.context.view_layer.objects.active = bar
        bpy.ops.ed.undo_push(message="Before the bake")
        return bpy.ops.exemplar.bake("INVOKE_DEFAULT")


def parts():
    return list(FOLDER.glob(".*.part"))


def escape(screen):
    TARGET.write_bytes(b"before")
    scene = screen.window.scene
    scene.frame_set(5)
    before = bake_support.scene_state(bpy.data.objects["Bar"])
    check(start(screen, 100_000) == {"RUNNING_MODAL"}, "runs beside the window")
    yield from wait_for(lambda: len(parts()) == 1, "writes beside the target")
    yield from wait_for(lambda: scene.frame_current > 5, "goes through the frames")
    screen.shoot("bake_2_progress")
    screen.tap("ESC")
    yield from wait_for(lambda: not parts(), "leaves nothing behind")
    yield 0.3
    check(TARGET.read_bytes() == b"before", "the previous file is untouched")
    check(bake_support.scene_state(bpy.data.objects["Bar"]) == before, "so is the scene")
    done("escape")


def bake(screen):
    scene = screen.window.scene
    bar = bpy.data.objects["Bar"]
    expected = bake_support.solved(addon, bar, range(FIRST, LAST + 1))
    start(screen, LAST)
    yield from wait_for(lambda: TARGET.stat().st_size > 100, "the file is there")
    yield 0.5
    check(scene.frame_current == 5, "back on its frame")
    check(not bar.exemplar.live, "Live is off")
    for frame, positions in expected.items():
        scene.frame_set(frame)
        seen = bake_support.evaluated_positions(bar, bpy.context.evaluated_depsgraph_get())
        check(abs(seen - positions).max() < 1e-6, f"plays frame {frame}")
    screen.shoot("bake_3_done")
    done("bake")


def undo(screen):
    with screen.override():
        bpy.ops.ed.undo()
    yield 0.5
    bar = bpy.data.objects["Bar"]
    check("Exemplar Bake" not in bar.modifiers and bar.exemplar.live, "one step takes it back")
    done("undo")


def another_file(screen):
    """Loading a file ends a bake that runs, and leaves no half file."""
    start(screen, 100_000)
    yield from wait_for(lambda: len(parts()) == 1, "it runs")
    # The story's own timer ends with the file.
    bpy.app.timers.register(after_loading, first_interval=1.0, persistent=True)
    with screen.override():
        bpy.ops.wm.read_homefile(use_factory_startup=True, load_ui=False)
    yield 60.0


def after_loading():
    if not parts():
        done("another_file")
    print("end", flush=True)
    os._exit(0)


if __name__ == "__main__":
    play(story())
