# SPDX-License-Identifier: GPL-3.0-or-later
"""Settings of a deformer under a name: some of our own, and the artist's, one JSON file each."""

import json
import os
from pathlib import Path

import bpy

from ..native import ExemplarError
from . import deformers

OWN = {
    "Body": ("AMRAP", {"lambda_": 0.5, "blend": "LOCAL", "rotations": True}),
    "Face": ("AMRAP", {"lambda_": 0.5, "blend": "LOCAL", "rotations": False}),
    "One Blend for All": ("AMRAP", {"lambda_": 0.5, "blend": "GLOBAL", "rotations": True}),
    "Any Mixture": ("AMRAP", {"lambda_": 0.0, "blend": "LOCAL", "rotations": True}),
    "Near One Exemplar": ("AMRAP", {"lambda_": 2.0, "blend": "LOCAL", "rotations": True}),
}
SIMPLE = {"BOOLEAN", "INT", "FLOAT", "STRING", "ENUM"}
MOST_LETTERS = 60


def saved_names():
    return sorted(path.stem for path in _folder().glob("*.json"))


def apply(obj, name):
    """Set what the preset holds. Where it does not fit: ExemplarError, and nothing is changed."""
    kind, values = OWN[name] if name in OWN else _read(name)
    group = _settings(obj.exemplar, kind)
    for key, value in values.items():
        _check(group, name, key, value)
    obj.exemplar.deformer = kind
    for key, value in values.items():
        setattr(group, key, value)


def save(obj, name):
    """What is set now; a preset of that name is replaced."""
    name = name.strip()
    if not name or len(name) > MOST_LETTERS or name in OWN or os.sep in name or name[0] == ".":
        raise ExemplarError(
            f"'{name}' cannot be the name of a preset. Choose another, without a slash."
        )
    kind = deformers.current(obj).identifier
    group = _settings(obj.exemplar, kind)
    values = {p.identifier: _value(group, p) for p in _simple_properties(group)}
    path = _folder() / f"{name}.json"
    partial = path.with_suffix(".part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(json.dumps({"deformer": kind, "settings": values}, indent=1))
        partial.replace(path)
    except OSError as error:
        raise ExemplarError(f"The preset cannot be written: {error}") from None


def remove(name):
    try:
        (_folder() / f"{name}.json").unlink()
    except OSError as error:
        raise ExemplarError(f"The preset cannot be removed: {error}") from None


def _folder():
    return Path(bpy.utils.user_resource("DATAFILES", path="exemplar_presets"))


def _read(name):
    path = _folder() / f"{name}.json"
    try:
        held = json.loads(path.read_text())
        kind, values = held["deformer"], dict(held["settings"])
    except (OSError, ValueError, KeyError, TypeError):
        raise ExemplarError(f"Preset '{name}' cannot be read: {path}") from None
    if kind not in deformers.TYPES:
        raise ExemplarError(f"Preset '{name}' is for the deformer '{kind}', which is not here.")
    return kind, values


def _settings(rig, kind):
    return getattr(rig, kind.lower())


def _simple_properties(group):
    hidden = {"rna_type", "name"}
    return [
        p
        for p in group.bl_rna.properties
        if p.type in SIMPLE and not p.is_hidden and p.identifier not in hidden
    ]


def _value(group, prop):
    value = getattr(group, prop.identifier)
    return list(value) if getattr(prop, "is_array", False) else value


def _check(group, name, key, value):
    props = {p.identifier: p for p in _simple_properties(group)}
    prop = props.get(key)
    fits = prop is not None and (
        (prop.type == "ENUM" and value in [item.identifier for item in prop.enum_items])
        or (prop.type == "BOOLEAN" and isinstance(value, bool))
        or (prop.type == "STRING" and isinstance(value, str))
        or (prop.type in {"INT", "FLOAT"} and isinstance(value, (int, float, list)))
    )
    if not fits:
        raise ExemplarError(f"Preset '{name}' has a setting that is not known here: {key}.")
