# SPDX-License-Identifier: GPL-3.0-or-later
"""Calls go downward only: read off the include and import lines. CONTRIBUTING.md has the rules."""

import ast
import re
import sys

import support

LIBRARY = support.ROOT / "libcore" / "src"
ADDON = support.ROOT / "blender_addon"

# What a layer may include besides itself.
BELOW = {
    "base": set(),
    "linalg": {"base"},
    "numeric": {"linalg", "base"},
    "mesh": {"numeric", "linalg", "base"},
    "weights": {"mesh", "numeric", "linalg", "base"},
    "subspace": {"mesh", "numeric", "linalg", "base"},
    "deform": {"weights", "subspace", "mesh", "numeric", "linalg", "base"},
    "sequence": {"weights", "subspace", "mesh", "numeric", "linalg", "base"},
    "registration": {"deform", "weights", "subspace", "mesh", "numeric", "linalg", "base"},
    "api": {
        "registration",
        "sequence",
        "deform",
        "weights",
        "subspace",
        "mesh",
        "numeric",
        "linalg",
        "base",
    },
}

# Third-party headers and the one file that may see them.
DOORS = [
    (re.compile(r"OpenMesh/"), "mesh/openmesh_shim.cpp"),
    (re.compile(r"(suitesparse/)?(cholmod|SuiteSparse|amd|camd|metis)"), "linalg/cholesky.c"),
    (re.compile(r"(lapacke?|cblas|openblas)"), "linalg/dense.c"),
    (re.compile(r"(arpack|parpack|arpack-ng)"), "linalg/eigen.c"),
]

PYTHON_BELOW = {
    "native": set(),
    "properties": {"scene", "native"},
    "scene": {"native"},
    "operators": {"scene", "native", "properties"},
    "ui": {"operators", "scene", "native", "properties"},
}


def includes():
    """(file relative to libcore/src, included name, is it quoted) of every include line."""
    for path in sorted(LIBRARY.rglob("*.[ch]*")):
        for line in path.read_text().splitlines():
            found = re.match(r'\s*#\s*include\s+(["<])([^">]+)[">]', line)
            if found:
                yield path.relative_to(LIBRARY), found[2], found[1] == '"'


def imports():
    """(file relative to blender_addon, absolute name within the add-on or outside)."""
    for path in sorted(ADDON.rglob("*.py")):
        inside = path.relative_to(ADDON)
        package = list(inside.parts[:-1])
        for node in ast.walk(ast.parse(path.read_text(), str(path))):
            if isinstance(node, ast.Import):
                yield from ((inside, None, alias.name) for alias in node.names)
            elif isinstance(node, ast.ImportFrom) and node.level == 0:
                yield inside, None, node.module
            elif isinstance(node, ast.ImportFrom):
                base = package[: len(package) - node.level + 1]
                base += node.module.split(".") if node.module else []
                for alias in node.names:
                    yield inside, ".".join([*base, alias.name]), None


def test_there_is_something_to_check():
    assert sum(1 for _ in includes()) > 20
    assert sum(1 for _ in imports()) > 20


def test_every_folder_is_a_known_layer():
    folders = {path.name for path in LIBRARY.iterdir() if path.is_dir()}
    assert folders <= set(BELOW), folders - set(BELOW)


def test_includes_go_downward():
    wrong = []
    for path, name, quoted in includes():
        layer, target = path.parts[0], name.split("/")[0]
        if quoted and "/" in name and target != layer and target not in BELOW[layer]:
            wrong.append(f"{path} includes {name}")
    assert not wrong, "\n".join(wrong)


def test_includes_name_their_layer():
    """No "../" and no bare sibling: a reader sees the layer in every line."""
    wrong = [
        f"{path} includes {name}"
        for path, name, quoted in includes()
        if quoted and name != "exemplar.h" and name.split("/")[0] not in BELOW
    ]
    assert not wrong, "\n".join(wrong)


def test_third_party_headers_have_one_door():
    wrong = []
    for path, name, _ in includes():
        for pattern, door in DOORS:
            if pattern.match(name) and str(path) != door:
                wrong.append(f"{path} includes {name}, which is for {door} alone")
    assert not wrong, "\n".join(wrong)


def test_one_file_is_cpp():
    found = [str(path.relative_to(LIBRARY)) for path in LIBRARY.rglob("*.cpp")]
    assert found == ["mesh/openmesh_shim.cpp"], found


def test_imports_go_downward():
    wrong = []
    for path, name, _ in imports():
        layer = path.parts[0] if len(path.parts) > 1 else None
        target = name.split(".")[0] if name else None
        if layer in PYTHON_BELOW and target in PYTHON_BELOW:
            if target != layer and target not in PYTHON_BELOW[layer]:
                wrong.append(f"{path} imports {name}")
    assert not wrong, "\n".join(wrong)


def test_native_never_imports_blender():
    blender = {"bpy", "bmesh", "mathutils", "bpy_extras", "gpu", "blf"}
    wrong = [
        f"{path} imports {module}"
        for path, _, module in imports()
        if path.parts[0] == "native" and module and module.split(".")[0] in blender
    ]
    assert not wrong, "\n".join(wrong)


def test_addon_needs_what_blender_brings_and_no_more():
    """Blender ships numpy and nothing else that is worth an import."""
    allowed = {"bpy", "bmesh", "mathutils", "bpy_extras", "gpu", "gpu_extras", "blf", "numpy"}
    allowed |= set(sys.stdlib_module_names) | {"command_line"}
    wrong = [
        f"{path} imports {module}"
        for path, _, module in imports()
        if module and module.split(".")[0] not in allowed
    ]
    assert not wrong, "\n".join(wrong)


if __name__ == "__main__":
    support.run(globals())
