# SPDX-License-Identifier: GPL-3.0-or-later
"""Values at vertices as a colour attribute, which shows in Solid and can be rendered."""

import numpy

# From 0 to 1, in linear light: the colours of weight painting.
RAMP = numpy.array([(0, 0, 0.8), (0, 0.6, 0.8), (0, 0.7, 0), (0.9, 0.8, 0), (0.9, 0, 0)])


def of(shares):
    """float32 [V][4] of shares [V]; what is outside of 0..1 counts as its ends."""
    steps = numpy.linspace(0, 1, len(RAMP))
    out = numpy.ones((len(shares), 4), numpy.float32)
    for k in range(3):
        out[:, k] = numpy.interp(shares, steps, RAMP[:, k])
    return out


def write(mesh, name, found):
    """Make `found` [V][4] the mesh's active colours, under a name."""
    layer = mesh.color_attributes.get(name)
    if layer is None:
        layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "POINT")
    layer.data.foreach_set("color", found.ravel())
    mesh.color_attributes.active_color = layer
    mesh.update()
