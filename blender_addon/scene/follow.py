# SPDX-License-Identifier: GPL-3.0-or-later
"""Make empties that are hidden, or left out of renders, move all the same.

Blender evaluates a hidden object only where something visible depends on it. So the object that
shows the result depends on the empties: by a driver that sums coordinates into a property that
nothing reads. It needs no Python, moves nothing, and does not make the mesh be evaluated again.
"""

PATH = "exemplar.follow"


def follow(shown, empties, path=PATH):
    """`shown` is the object that shows the result. An earlier driver is replaced."""
    unfollow(shown, path)
    driver = shown.driver_add(path).driver
    driver.type = "SUM"
    for empty in empties:
        variable = driver.variables.new()
        variable.type = "TRANSFORMS"
        variable.targets[0].id = empty
        variable.targets[0].transform_space = "WORLD_SPACE"


def unfollow(shown, path=PATH):
    shown.driver_remove(path)
    animation = shown.animation_data
    if animation and not (animation.action or animation.drivers or animation.nla_tracks):
        shown.animation_data_clear()
