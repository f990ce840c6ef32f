# SPDX-License-Identifier: GPL-3.0-or-later
"""Run in Blender by test_addon_zip.py; prints one line of JSON.

    install ZIP        install and enable it, and keep that in the profile
    use BLEND PC2      bind, solve and bake with the add-on that the profile has enabled
"""

import importlib
import json
import os
import sys
from pathlib import Path

import bpy

sys.path.insert(0, os.path.dirname(__file__))


def install(path):
    if hasattr(bpy.ops, "extensions") and bpy.app.version >= (4, 2, 0):
        bpy.ops.extensions.package_install_files(
            filepath=path, repo="user_default", enable_on_install=True
        )
    else:
        bpy.ops.preferences.addon_install(filepath=path)
        bpy.ops.preferences.addon_enable(module="exemplar")
    bpy.ops.wm.save_userpref()
    module = enabled_module()
    return {"module": module, "folder": os.path.dirname(sys.modules[module].__file__)}


def enabled_module():
    """The name that Blender knows the add-on by: another for an extension."""
    names = [n for n in bpy.context.preferences.addons.keys() if n.split(".")[-1] == "exemplar"]
    assert len(names) == 1, names
    return names[0]


def use(blend, pc2_path):
    import bake_support
    import numpy as np

    module = enabled_module()

    def addon(path):
        return importlib.import_module(f"{module}.{path}")

    bpy.ops.wm.read_homefile(use_empty=True)
    bar = bake_support.make_bar(addon)
    frames = range(bake_support.FIRST, bake_support.LAST + 1)
    solved = np.stack(list(bake_support.solved(addon, bar, frames).values()))
    bpy.ops.wm.save_as_mainfile(filepath=blend)
    bpy.ops.exemplar.bake(format="PC2", filepath=pc2_path)
    _, baked = addon("scene.baking.pc2").read(pc2_path)
    maps = Path("/proc/self/maps").read_text().splitlines()
    loaded = {line.split(maxsplit=5)[5] for line in maps if ".so" in line}
    return {
        "difference": float(np.abs(baked - solved).max()),
        "moved": float(np.abs(solved - solved[0]).max()),
        "loaded": sorted(loaded),
    }


def main(what, *arguments):
    print("RESULT " + json.dumps({"install": install, "use": use}[what](*arguments)))


main(*sys.argv[sys.argv.index("--") + 1 :])  # noqa: E203
