# SPDX-License-Identifier: GPL-3.0-or-later
"""Bake without a window, for scripts and render farms.

    blender -b scene.blend --python <add-on>/command_line.py -- bake --object NAME --out FILE
    blender -b scene.blend --python <add-on>/command_line.py -- list

Works from the add-on's own folder, whether the add-on is enabled or not. Everything after `--` is
ours, everything before it Blender's.
"""

import argparse
import contextlib
import importlib
import importlib.util
import json
import os
import re
import shutil
import signal
import sys
import traceback

FOLDER = os.path.dirname(os.path.realpath(__file__))
PACKAGE = "exemplar"

DONE = 0
UNEXPECTED = 1
USAGE = 2
NO_OBJECT = 3
SOLVE_FAILED = 4
WRITE_FAILED = 5
NO_LIBRARY = 6

EXIT_CODES = """\
exit codes:
  0    done
  1    a fault of this program; the traceback is on stderr
       (Blender itself exits with 1 when it cannot read the .blend file)
  2    the arguments make no sense, or ask for what cannot be baked
  3    the file has no such object, or it is not bound
  4    the solve failed: the mesh was edited since Bind, a handle is gone, ...
  5    the file cannot be written: folder, permission, disk full
  6    the native library is missing or does not fit this machine
  130  interrupted (128 + the signal's number)

Whatever the code, an existing output file is either replaced by a whole new one or not touched."""

FORMATS = {"pc2": "PC2", "mdd": "MDD", "shape-keys": "SHAPE_KEYS", "weights": "WEIGHTS"}


class Failure(Exception):
    """Ends the program with a sentence and an exit code."""

    def __init__(self, code, message):
        super().__init__(message)
        self.code = code


class Interruption:
    """A signal that has arrived. It is looked at between frames: raised from the signal handler, an
    exception would end in whatever Blender is calling just then, which prints it and goes on."""

    number = 0

    @classmethod
    def note(cls, number, _frame):
        cls.number = number

    @classmethod
    def check(cls):
        if cls.number:
            raise Failure(128 + cls.number, "interrupted")


# --------------------------------------------------------------------------------------- arguments


def frame_range(text):
    """'A-B' or 'A-B:STEP' or 'A'"""
    match = re.fullmatch(r"(-?\d+)(?:-(-?\d+))?(?::(\d+))?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form A-B or A-B:STEP")
    start = int(match[1])
    end = start if match[2] is None else int(match[2])
    return start, end, 1 if match[3] is None else int(match[3])


def make_parser():
    parser = argparse.ArgumentParser(
        prog="blender -b FILE.blend --python command_line.py --",
        description="Bake Exemplar objects without a window.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    commands = parser.add_subparsers(dest="command", required=True, metavar="COMMAND")
    bake = commands.add_parser("bake", help="solve every frame and write the result")
    bake.add_argument(
        "--object",
        required=True,
        metavar="NAME",
        help="the bound mesh object, or one that shows a sequence",
    )
    bake.add_argument(
        "--frames",
        type=frame_range,
        metavar="A-B[:STEP]",
        help="default: the scene's range. With a negative first frame write --frames=-10-20",
    )
    bake.add_argument("--out", metavar="FILE", help="of pc2 and mdd")
    bake.add_argument(
        "--format", choices=FORMATS, help="default: what the ending of --out says, else pc2"
    )
    bake.add_argument(
        "--save-blend",
        metavar="FILE",
        help="save a .blend file that plays the bake without the add-on",
    )
    bake.add_argument("--scene", metavar="NAME", help="default: the one that has the object")
    bake.add_argument("--quiet", action="store_true", help="no line for each frame")
    listing = commands.add_parser("list", help="the bound objects of the file")
    listing.add_argument("--json", action="store_true", help="for programs")
    return parser


def parse(arguments):
    parser = make_parser()
    options = parser.parse_args(arguments)
    if options.command == "bake":
        if options.format is None:
            ending = os.path.splitext(options.out or "")[1].lower()
            options.format = "mdd" if ending == ".mdd" else "pc2"
        in_blend = options.format in ("shape-keys", "weights")
        if in_blend and not options.save_blend:
            parser.error(f"--format {options.format} is kept in a .blend file: give --save-blend")
        if in_blend and options.out:
            parser.error(f"--out is for pc2 and mdd; --format {options.format} has --save-blend")
        if not in_blend and not options.out:
            parser.error(f"--format {options.format} needs --out")
    return options


# ------------------------------------------------------------------------------------------ add-on


def load_addon():
    """A function that imports modules of the add-on, which is registered if it was not."""
    name = enabled_package()
    if name is None:
        name = PACKAGE
        spec = importlib.util.spec_from_file_location(
            name, os.path.join(FOLDER, "__init__.py"), submodule_search_locations=[FOLDER]
        )
        module = importlib.util.module_from_spec(spec)
        sys.modules[name] = module
        spec.loader.exec_module(module)
        module.register()
        module.registered_here = True
    return lambda path: importlib.import_module(f"{name}.{path}")


def enabled_package():
    """The name under which the add-on is enabled, or None.

    By Blender's mark on the module and not by the preferences: --addons enables without them. A
    copy from another place counts too, for it has registered the same classes.
    """
    for name, module in list(sys.modules.items()):
        enabled = getattr(module, "__addon_enabled__", False)
        if enabled or getattr(module, "registered_here", False) is True:
            place = os.path.dirname(os.path.realpath(getattr(module, "__file__", None) or ""))
            if place == FOLDER or name.rpartition(".")[2] == PACKAGE:
                return name
    return None


# ---------------------------------------------------------------------------------------- commands


def list_objects(options, addon):
    import bpy

    is_sequence = addon("scene.sequences.owners").is_owner
    rows = [
        {
            "object": obj.name,
            "kind": "sequence" if is_sequence(obj) else "deformer",
            "scenes": [scene.name for scene in obj.users_scene],
            "handles": len(obj.exemplar.handles),
            "shape_keys": len(obj.data.shape_keys.key_blocks) if obj.data.shape_keys else 0,
        }
        for obj in bpy.data.objects
        if addon("scene.baking.sampling").can_be_baked(obj)
    ]
    if options.json:
        print(json.dumps(rows))
    elif not rows:
        print("No object of this file is bound.")
    for row in [] if options.json else rows:
        if row["kind"] == "sequence":
            print(f"{row['object']}: a sequence")
            continue
        print(f"{row['object']}: {row['handles']} handles, {row['shape_keys']} shape keys")
    return DONE


def bake(options, addon):
    job = addon("scene.baking.job")
    obj, scene, view_layer = find_object(options, addon)
    start, end, step = options.frames or (scene.frame_start, scene.frame_end, 1)
    settings = job.Settings(
        format=FORMATS[options.format],
        start=start,
        end=end,
        step=step,
        filepath=stored_path(options.out) if options.out else "",
        use_modifier=bool(options.save_blend),
        stop_live=bool(options.save_blend),
    )
    with contextlib.closing(job.run(obj, scene, view_layer, settings)) as steps:
        result = exhaust(steps, options.quiet)
    print(result.message)
    Interruption.check()
    if options.save_blend:
        save(os.path.abspath(options.save_blend))
    return DONE


def find_object(options, addon):
    """(object, scene, view layer) with what the library and the file have to say against it."""
    import bpy

    obj = bpy.data.objects.get(options.object)
    if obj is None:
        raise Failure(NO_OBJECT, f"The file has no object '{options.object}'")
    if not addon("scene.baking.sampling").can_be_baked(obj):
        raise Failure(NO_OBJECT, f"'{obj.name}' is not bound")
    if options.scene:
        scenes = [scene for scene in obj.users_scene if scene.name == options.scene]
    else:
        # The scene that the file opens with comes first.
        scenes = sorted(obj.users_scene, key=lambda scene: scene != bpy.context.scene)
    for scene in scenes:
        for view_layer in scene.view_layers:
            if obj.name in view_layer.objects:
                if bpy.context.window is not None:
                    bpy.context.window.scene = scene
                return obj, scene, view_layer
    where = f"scene '{options.scene}'" if options.scene else "any scene"
    raise Failure(NO_OBJECT, f"'{obj.name}' is not in {where}, or excluded from its view layers")


def stored_path(out):
    """As the modifier is to keep it: relative to the .blend file, so that both can move."""
    import bpy

    absolute = os.path.abspath(out)
    if not bpy.data.filepath:
        return absolute
    try:
        return bpy.path.relpath(absolute)
    except ValueError:  # another drive of Windows
        return absolute


def exhaust(steps, quiet):
    """Run a generator to its end and return what it returns."""
    while True:
        try:
            progress = next(steps)
        except StopIteration as stop:
            return stop.value
        Interruption.check()
        if not quiet:
            print(f"Frame {progress.frame} ({progress.done} of {progress.total})", flush=True)


def save(path):
    import bpy

    try:
        done = bpy.ops.wm.save_as_mainfile(filepath=path, copy=True, check_existing=False)
    except RuntimeError as error:
        raise Failure(WRITE_FAILED, f"Cannot save {path}: {str(error).strip()}") from error
    if done != {"FINISHED"} or not os.path.isfile(path):
        raise Failure(WRITE_FAILED, f"Cannot save {path}")
    print(f"Saved {path}")


# -------------------------------------------------------------------------------------------- main


def run(options):
    addon = load_addon()
    errors = addon("native.errors")
    bake_errors = addon("scene.baking.errors")
    commands = {"bake": bake, "list": list_objects}
    try:
        return commands[options.command](options, addon)
    except bake_errors.WriteError as error:
        raise Failure(WRITE_FAILED, str(error)) from error
    except bake_errors.BakeError as error:
        raise Failure(USAGE, str(error)) from error
    except errors.LibraryError as error:
        raise Failure(NO_LIBRARY, str(error)) from error
    except errors.ExemplarError as error:
        raise Failure(SOLVE_FAILED, str(error)) from error


def main(arguments):
    """The exit code; whatever goes wrong is on stderr by then."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, Interruption.note)
    if hasattr(signal, "SIGXFSZ"):
        # A file over the user's limit is to be an error of that file, not the end of Blender.
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    try:
        return run(parse(arguments))
    except SystemExit as request:  # argparse: --help, or a usage error
        return request.code or DONE
    except Failure as failure:
        print(f"exemplar: {failure}", file=sys.stderr)
        return failure.code
    except Exception:
        traceback.print_exc()
        return UNEXPECTED


def leave(code):
    """End Blender with this exit code, now: after a script it would go on and exit with 0."""
    sys.stdout.flush()
    sys.stderr.flush()
    with contextlib.suppress(ImportError, OSError):
        import bpy

        shutil.rmtree(bpy.app.tempdir)  # Blender's own session folder, which os._exit leaves behind
    os._exit(code)


def own_arguments():
    """What follows `--`."""
    found = sys.argv.index("--") if "--" in sys.argv else len(sys.argv)
    return sys.argv[found + 1 :]  # noqa: E203


if __name__ == "__main__":
    leave(main(own_arguments()))
