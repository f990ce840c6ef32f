# SPDX-License-Identifier: GPL-3.0-or-later
"""PC2 read on our own, to check what the add-on wrote."""

import struct

import numpy as np


def read_pc2(path):
    """First frame, positions float32 [frames][vertices][3]."""
    data = path.read_bytes()
    magic, version, vertices, start, step, samples = struct.unpack_from("<12siiffi", data)
    if magic != b"POINTCACHE2\0" or version != 1 or step != 1.0:
        raise ValueError(f"{path} is not a PC2 file of every frame")
    if len(data) != 32 + 12 * vertices * samples:
        raise ValueError(f"{path} has {len(data)} bytes, which do not fit its header")
    return start, np.frombuffer(data, "<f4", offset=32).reshape(samples, vertices, 3)
