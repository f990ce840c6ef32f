# SPDX-License-Identifier: GPL-3.0-or-later
"""Find, load and check the native library: each a step of its own, to say which of them failed."""

import ctypes
import os
import platform
import struct
import sys
from pathlib import Path

from .declarations import ABI_VERSION, declare
from .errors import LibraryError

VARIABLE = "EXEMPLAR_LIBRARY"

_loaded = None  # (library, path) once loading has succeeded


def file_name():
    if sys.platform == "win32":
        return "exemplar.dll"
    if sys.platform == "darwin":
        return "libexemplar.dylib"
    return "libexemplar.so"


def bundled_path():
    """Where the installed add-on has it."""
    return Path(__file__).resolve().parent / "lib" / file_name()


def find():
    """The library's file: beside the add-on, where the variable says, or in a build tree.

    In that order: what was installed is what runs, whatever the environment holds.
    """
    bundled = bundled_path()
    if bundled.is_file():
        return bundled
    named = os.environ.get(VARIABLE)
    if named:
        if not Path(named).is_file():
            raise LibraryError(
                f"The environment variable {VARIABLE} names {named}, which is not a file."
            )
        return Path(named)
    built = _newest_build(Path(__file__).resolve().parents[2] / "build")
    if built:
        return built
    raise LibraryError(
        f"The native library is missing: {bundled} does not exist. "
        "Install the add-on from its zip for this system, "
        f"or set {VARIABLE} to the path of {file_name()}."
    )


def _newest_build(folder):
    """Sanitized builds are passed over: they load only into sanitized programs."""
    found = [*folder.glob(file_name()), *folder.glob(f"*/{file_name()}")]
    plain = [path for path in found if "san" not in path.parent.name]
    return max(plain, key=lambda path: path.stat().st_mtime, default=None)


def library():
    """The loaded library. Raises LibraryError, each time anew, while it cannot be had."""
    global _loaded
    if _loaded is None:
        path = find()
        _loaded = (load(path), path)
    return _loaded[0]


def library_path():
    library()
    return _loaded[1]


def library_version():
    return library().exm_version().decode()


def load(path):
    """Load one file and make sure that it is what this code was written for."""
    if _is_cut_short(path):
        raise LibraryError(f"{path} is incomplete: the file is cut short. Install the add-on anew.")
    try:
        loaded = ctypes.CDLL(str(path))
    except OSError as error:
        raise LibraryError(_why_not_loaded(path, error)) from None
    try:
        loaded.exm_abi_version.restype = ctypes.c_uint32
        loaded.exm_version.restype = ctypes.c_char_p
        abi, version = loaded.exm_abi_version(), loaded.exm_version().decode()
    except AttributeError:
        raise LibraryError(f"{path} is not the Exemplar library.") from None
    if abi != ABI_VERSION:
        raise LibraryError(
            f"{path} is Exemplar {version} with interface {abi}, but this add-on needs interface "
            f"{ABI_VERSION}. Install an add-on and a library of the same release."
        )
    try:
        declare(loaded)
    except AttributeError as error:
        raise LibraryError(f"{path} (Exemplar {version}) is incomplete: {error}") from None
    return loaded


def _is_cut_short(path):
    """Loading one would end the whole program: pages are mapped that the file does not have."""
    with open(path, "rb") as file:
        head = file.read(64)
        size = file.seek(0, 2)
    if head[:6] != b"\x7fELF\x02\x01" or len(head) < 64:
        return False
    sections, entry_size, count = struct.unpack_from("<Q10xHH", head, 40)
    return size < sections + entry_size * count


def _why_not_loaded(path, error):
    built_for = built_for_machine(path)
    here = this_machine()
    if built_for and built_for != here:
        return f"{path} was built for {built_for}, but this machine is {here}."
    return f"{path} cannot be loaded: {error}"


# -------------------------------------------------------------------------------- which machine

ELF_MACHINES = {0x03: "i386", 0x28: "arm", 0x3E: "x86_64", 0xB7: "aarch64", 0xF3: "riscv64"}
MACH_O = (b"\xcf\xfa\xed\xfe", b"\xfe\xed\xfa\xcf", b"\xca\xfe\xba\xbe")
SYSTEMS = {"linux": "Linux", "win32": "Windows", "darwin": "macOS"}


def this_machine():
    machine = {"AMD64": "x86_64", "arm64": "aarch64"}.get(platform.machine(), platform.machine())
    return f"{SYSTEMS.get(sys.platform, sys.platform)} on {machine}"


def built_for_machine(path):
    """In the words of this_machine(), from the first bytes of the file; "" if they say nothing."""
    try:
        with open(path, "rb") as file:
            head = file.read(20)
    except OSError:
        return ""
    if head[:4] == b"\x7fELF" and len(head) == 20:
        order = "little" if head[5] == 1 else "big"
        machine = int.from_bytes(head[18:20], order)
        return f"Linux on {ELF_MACHINES.get(machine, f'machine type {machine}')}"
    if head[:2] == b"MZ":
        return "Windows"
    if head[:4] in MACH_O:
        return "macOS"
    return ""
