# SPDX-License-Identifier: GPL-3.0-or-later
"""Which shape keys are exemplars: kept by name, and through renames by place."""

from . import meshes


def all_names(obj):
    return [key.name for key in meshes.exemplar_keys(obj)]


def enabled_names(obj):
    return [name for name in all_names(obj) if is_enabled(obj, name)]


def at_least(count):
    """In words"""
    return "an exemplar" if count == 1 else "two or more exemplars"


def is_enabled(obj, name):
    """A key that was never switched is on."""
    item = obj.exemplar.exemplars.get(name)
    if item is None:
        item = _renamed_item(obj, name)
    return item is None or item.enabled


def set_enabled(obj, name, enabled):
    sync(obj)
    obj.exemplar.exemplars[name].enabled = enabled


def sync(obj):
    """One item for each key. Writes, so draw functions go by is_enabled() alone."""
    items = obj.exemplar.exemplars
    names = all_names(obj)
    for name in names:
        item = items.get(name) or _renamed_item(obj, name) or items.add()
        item.name = name
    for index in reversed(range(len(items))):
        if items[index].name not in names:
            items.remove(index)
    for item in items:
        item.index = names.index(item.name)


def _renamed_item(obj, name):
    """The item of a key that had another name: nothing has that name now, and the place is its."""
    names = all_names(obj)
    place = names.index(name) if name in names else -1
    for item in obj.exemplar.exemplars:
        if item.index == place and item.name not in names:
            return item
    return None
