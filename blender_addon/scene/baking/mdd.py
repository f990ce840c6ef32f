# SPDX-License-Identifier: GPL-3.0-or-later
"""MDD, the point cache of LightWave, read by most packages and by Blender's Mesh Cache modifier.

Big-endian: int32 samples, int32 vertices, float32 [samples] times in seconds, float32
[samples][vertices][3].
"""

import struct
from dataclasses import dataclass

import numpy as np

from .errors import ReadError
from .samples import SampleWriter, read_samples

_HEADER = struct.Struct(">ii")
_DTYPE = ">f4"


@dataclass(frozen=True)
class Header:
    vertex_count: int
    times: np.ndarray  # [samples], seconds


def writer(path, header):
    """A SampleWriter; use it with `with`."""
    times = np.asarray(header.times, dtype=_DTYPE)
    packed = _HEADER.pack(len(times), header.vertex_count) + times.tobytes()
    return SampleWriter(path, packed, header.vertex_count, len(times), _DTYPE)


def read(path):
    """(Header, float32 [samples][vertices][3])"""
    with open(path, "rb") as file:
        raw = file.read(_HEADER.size)
        if len(raw) < _HEADER.size:
            raise ReadError(f"{path} is too short to be an MDD file")
        sample_count, vertex_count = _HEADER.unpack(raw)
        times = np.fromfile(file, dtype=_DTYPE, count=max(0, sample_count)).astype(np.float32)
        before = _HEADER.size + 4 * sample_count
        samples = read_samples(file, path, before, vertex_count, sample_count, _DTYPE)
    return Header(vertex_count, times), samples
