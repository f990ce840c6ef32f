# SPDX-License-Identifier: GPL-3.0-or-later
"""Between Blender's data and the native library.

versions    how Blenders differ              meshes     arrays of a mesh
handles     empties, vertex sets, targets    inputs     everything that a bind needs, checked
fingerprint what a bind was made from        bindings   one deformer for each bound object
results     where the result is shown        solving    a solve, from targets to positions
follow      keeps hidden empties evaluated   rigs       which objects are ours
live        handlers and timers              status     what to tell the artist
exemplars   which shape keys are used        setup      bind, unbind: all that they change
background  work in a thread              deformers  the kinds, behind one interface
proposals   where handles are wanted         quick_rig  handles that are proposed or mirrored
parts       connected parts of a mesh
presets     settings under a name            influence  blend weights as colours
figures     how fast the mesh follows
"""
