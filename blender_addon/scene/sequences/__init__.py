# SPDX-License-Identifier: GPL-3.0-or-later
"""Sequences: captured animation as three signals, and the pose space that edits them.

polygon     the control polygon as vertices and edges; no bpy
thumbnails  where shapes are drawn in the plane, and how coarse; no bpy
packing     a fitted sequence as bytes in the .blend
owners      which objects show a sequence, and what belongs to them
store       one native sequence for each packed one
capture     the frames of an animated object
setup       the objects of a sequence: made, and fitted anew
plane       the curve and the marks, as meshes of the pose space
syncing     edits in the plane become edits of the signals
solving     the shape for the time, or for the playhead
retiming    the F-curve of the time
transfer    the animation on another character
live        Blender's handlers
drawing     the pose space in the viewport
"""
