# SPDX-License-Identifier: GPL-3.0-or-later
"""A mesh fitted to scans.

    gathered = inputs.gather(obj, depsgraph)       # arrays, in the mesh's own space
    fitted = solving.fit(gathered, report)         # slow; may run in a thread
    outputs.write(obj, gathered, fitted)           # a shape key or an object, and attributes
"""
