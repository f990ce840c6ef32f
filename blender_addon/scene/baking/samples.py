# SPDX-License-Identifier: GPL-3.0-or-later
"""What PC2 and MDD share: a header, then samples of one size, streamed one by one."""

import os

import numpy as np

from .errors import ReadError
from .replacing import ReplacingFile


class SampleWriter:
    """Append every sample, then finish(): only then does the file appear under its name.

    header        bytes before the first sample
    vertex_count  V; a sample is [V][3]
    dtype         of the numbers in the file
    """

    def __init__(self, path, header, vertex_count, sample_count, dtype):
        self._header = header
        self._shape = (vertex_count, 3)
        self._dtype = np.dtype(dtype)
        self._left = sample_count
        size = len(header) + sample_count * vertex_count * 3 * self._dtype.itemsize
        self._file = ReplacingFile(path, size)

    def __enter__(self):
        self._file.__enter__()
        try:
            self._file.write(self._header)
        except BaseException:
            self._file.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self._file.__exit__()

    def append(self, positions):
        """positions  [V][3]"""
        if positions.shape != self._shape:
            raise ValueError(f"a sample is {self._shape}, not {positions.shape}")
        if self._left == 0:
            raise ValueError("one sample more than the header says")
        self._file.write(positions.astype(self._dtype).tobytes())
        self._left -= 1

    def finish(self):
        if self._left:
            raise ValueError(f"{self._left} samples fewer than the header says")
        self._file.commit()


def read_samples(file, path, header_size, vertex_count, sample_count, dtype):
    """float32 [sample_count][vertex_count][3] from the place the file is at.

    header_size  bytes before the first sample; with the counts it gives the length that the file
    must have
    """
    dtype = np.dtype(dtype)
    if vertex_count < 0 or sample_count < 0:
        raise ReadError(f"{path} has a negative size in its header")
    size = header_size + sample_count * vertex_count * 3 * dtype.itemsize
    if os.fstat(file.fileno()).st_size != size:
        raise ReadError(f"{path} does not have the length that its header says")
    file.seek(header_size)
    samples = np.fromfile(file, dtype=dtype, count=sample_count * vertex_count * 3)
    return samples.astype(np.float32).reshape(sample_count, vertex_count, 3)
