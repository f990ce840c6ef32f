# SPDX-License-Identifier: GPL-3.0-or-later
"""PC2, the point cache of 3ds Max and of Blender's Mesh Cache modifier.

Little-endian: "POINTCACHE2" and a zero byte, int32 version 1, int32 vertices, float32 first frame,
float32 frames a sample, int32 samples; then float32 [samples][vertices][3].
"""

import struct
from dataclasses import dataclass

from .errors import ReadError
from .samples import SampleWriter, read_samples

MAGIC = b"POINTCACHE2\0"
VERSION = 1
_HEADER = struct.Struct("<12siiffi")
_DTYPE = "<f4"


@dataclass(frozen=True)
class Header:
    vertex_count: int
    sample_count: int
    start: float  # frame of the first sample
    sampling: float  # frames from one sample to the next


def writer(path, header):
    """A SampleWriter; use it with `with`."""
    packed = _HEADER.pack(
        MAGIC, VERSION, header.vertex_count, header.start, header.sampling, header.sample_count
    )
    return SampleWriter(path, packed, header.vertex_count, header.sample_count, _DTYPE)


def read(path):
    """(Header, float32 [samples][vertices][3])"""
    with open(path, "rb") as file:
        raw = file.read(_HEADER.size)
        if len(raw) < _HEADER.size:
            raise ReadError(f"{path} is too short to be a PC2 file")
        magic, version, vertex_count, start, sampling, sample_count = _HEADER.unpack(raw)
        if magic != MAGIC or version != VERSION:
            raise ReadError(f"{path} is not a PC2 file of version {VERSION}")
        samples = read_samples(file, path, _HEADER.size, vertex_count, sample_count, _DTYPE)
    return Header(vertex_count, sample_count, start, sampling), samples
