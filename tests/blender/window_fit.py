# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in a real window by test_fit_window.py: pick landmarks, fit, cancel, undo.

Prints "ok STEP" for each step that went well; screenshots go to the folder after `--`.
"""

import os
import sys

import bpy
from mathutils import Matrix, Vector

sys.path.insert(0, os.path.dirname(__file__))
import addon_support as support  # noqa: E402
import fit_support  # noqa: E402
from blender_addon.scene import background  # noqa: E402
from window_addon import Screen, check, done, open_tab, play, wait_for  # noqa: E402

APART = 4.5
SEEN = (0, 1, 3, 4)  # limbs that a view from the front shows


def story():
    screen = Screen()
    yield from set_the_stage(screen)
    yield from pick(screen)
    yield from escape(screen)
    yield from fit(screen)
    yield from undo(screen)


def body():
    return bpy.data.objects["Body"]


def keys():
    return [key.name for key in body().data.shape_keys.key_blocks]


def unfold(screen):
    """Close the first panel of the tab by its header, and open the one that moves up below it."""
    sidebar = screen.region("UI")
    top = sidebar.y + sidebar.height - 12
    for down in (0, 26):
        screen.move(sidebar.x + 60, top - down)
        yield 0.1
        screen.tap("LEFTMOUSE")
        yield 0.5


def set_the_stage(screen):
    for obj in list(bpy.data.objects):
        bpy.data.objects.remove(obj)
    with screen.override():
        mesh = fit_support.make_body()
        scan = fit_support.make_scan("Scan", fit_support.TRUTH)
        scan.matrix_world = Matrix.Translation((APART, 0, 0))
        support.activate(mesh)
        mesh.exemplar_fit.scan = scan
        bpy.ops.view3d.view_axis(type="FRONT")
    yield 0.3
    with screen.override():
        screen.area.spaces.active.show_region_ui = True
        bpy.ops.view3d.view_all()
    yield 0.5
    yield from open_tab(screen)
    yield from unfold(screen)
    screen.shoot("fit_1_ready")
    done("panel")


def pick(screen):
    """The tip of each limb that is seen, on the mesh and on the scan."""
    with screen.override():
        check(bpy.ops.exemplar.fit_pick("INVOKE_DEFAULT") == {"RUNNING_MODAL"}, "asks for points")
    yield 0.2
    tips = []
    for limb in SEEN:
        way = fit_support.unit(fit_support.LIMBS[limb][0])[None]
        at_rest = Vector(fit_support.body(way, [0] * fit_support.LIMB_COUNT)[0])
        posed = Vector(fit_support.body(way, fit_support.TRUTH)[0])
        # A little inside, for what is seen of a tip is its front.
        for place in (0.93 * at_rest, Vector((APART, 0, 0)) + 0.93 * posed):
            screen.move(*screen.place_of(place))
            yield 0.1
            screen.tap("LEFTMOUSE")
            yield 0.2
        tips.append(at_rest)
    screen.shoot("fit_2_picked")
    screen.tap("RET")
    yield 0.3
    items = body().exemplar_fit.landmarks
    check(len(items) == len(SEEN), f"{len(items)} landmarks")
    for item, tip in zip(items, tips):
        found = body().data.vertices[item.vertex].co
        check((found - tip).length < 0.6, f"{item.name} is at {tuple(found)}, not {tuple(tip)}")
    done("pick")


def escape(screen):
    before = keys()
    with screen.override():
        support.activate(body())
        check(bpy.ops.exemplar.fit("INVOKE_DEFAULT") == {"RUNNING_MODAL"}, "runs beside the window")
    yield 0.1
    screen.tap("ESC")
    yield from wait_for(lambda: not background.running(), "ends")
    yield 0.3
    check(keys() == before, "nothing was changed")
    done("escape")


def fit(screen):
    with screen.override():
        support.activate(body())
        bpy.ops.exemplar.fit("INVOKE_DEFAULT")
    yield 0.3
    screen.shoot("fit_3_progress")
    yield from wait_for(lambda: "Fit Scan" in keys(), "the shape key", 120)
    yield 0.5
    screen.shoot("fit_4_done")
    check(body().exemplar_fit.message != "", "says how it went")
    done("fit")


def undo(screen):
    with screen.override():
        bpy.ops.ed.undo()
    yield 0.3
    check("Fit Scan" not in keys(), "the key is gone")
    check(len(body().exemplar_fit.landmarks) == len(SEEN), "landmarks stay")
    done("undo")


if __name__ == "__main__":
    play(story())
