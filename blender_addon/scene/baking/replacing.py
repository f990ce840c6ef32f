# SPDX-License-Identifier: GPL-3.0-or-later
"""A file that is either wholly there or not touched at all.

What is written goes to a hidden file beside the target (the same file system, so that the last step
is a rename), is flushed to the disk, and takes the target's name only when it is complete.
"""

import contextlib
import errno
import os
import secrets
import shutil

from .errors import WriteError

# No room, quota used up, larger than this file system or this process may write.
_NO_SPACE = {errno.ENOSPC, errno.EDQUOT, errno.EFBIG}


def size_text(byte_count):
    """A size for people: '31.4 MB'."""
    value = float(byte_count)
    for unit in ("bytes", "kB", "MB", "GB"):
        if value < 1000.0:
            break
        value /= 1000.0
    else:
        unit = "TB"
    return f"{value:.0f} {unit}" if unit == "bytes" else f"{value:.1f} {unit}"


class ReplacingFile:
    """Write `size` bytes, then commit(); leaving the `with` block earlier leaves the target as it
    was.

    The space is claimed before the first byte, so that a full disk shows before hours of solving.
    """

    def __init__(self, path, size):
        # Through links: the link must go on pointing at the file, not be replaced by it.
        self.path = os.path.realpath(path)
        self.size = size
        self._temporary = None
        self._descriptor = None

    def __enter__(self):
        folder, name = os.path.split(self.path)
        if not os.path.isdir(folder):
            raise WriteError(f"Cannot write {self.path}: there is no folder {folder}")
        if os.path.isdir(self.path):
            raise WriteError(f"Cannot write {self.path}: a folder has that name")
        try:
            if os.path.exists(self.path) and not _may_write(self.path):
                raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
            self._check_free_space(folder)
            # 120: a name may have 255 bytes, and this one is longer than the target's.
            temporary = os.path.join(folder, f".{name[:120]}.{secrets.token_hex(4)}.part")
            flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
            self._descriptor = os.open(temporary, flags, 0o666)
            self._temporary = temporary
            self._claim_space()
        except OSError as error:
            self._discard()
            raise self._explained(error) from error
        except BaseException:
            self._discard()
            raise
        return self

    def __exit__(self, *_):
        self._discard()

    def write(self, data):
        """Append bytes, or anything with their buffer."""
        view = memoryview(data).cast("B")
        try:
            while len(view):
                written = os.write(self._descriptor, view)
                view = view[written:]
        except OSError as error:
            raise self._explained(error) from error

    def commit(self):
        """Put the finished file in place of the target."""
        try:
            os.fsync(self._descriptor)
            os.close(self._descriptor)
            self._descriptor = None
            if os.path.exists(self.path):
                with contextlib.suppress(OSError):
                    shutil.copymode(self.path, self._temporary)
            os.replace(self._temporary, self.path)
            self._temporary = None
        except OSError as error:
            raise self._explained(error) from error
        _flush_folder(os.path.dirname(self.path))

    def _check_free_space(self, folder):
        free = shutil.disk_usage(folder).free
        if free < self.size:
            raise WriteError(
                f"The disk is full: {self.path} needs {size_text(self.size)}, "
                f"{size_text(free)} are free"
            )

    def _claim_space(self):
        if self.size <= 0 or not hasattr(os, "posix_fallocate"):
            return
        try:
            os.posix_fallocate(self._descriptor, 0, self.size)
        except OSError as error:
            # Some network file systems cannot claim; then the writes themselves will tell.
            if error.errno in _NO_SPACE:
                raise

    def _discard(self):
        if self._descriptor is not None:
            with contextlib.suppress(OSError):
                os.close(self._descriptor)
            self._descriptor = None
        if self._temporary is not None:
            with contextlib.suppress(OSError):
                os.unlink(self._temporary)
            self._temporary = None

    def _explained(self, error):
        if error.errno in _NO_SPACE:
            return WriteError(
                f"The disk is full: {self.path} needs {size_text(self.size)} ({error.strerror})"
            )
        return WriteError(f"Cannot write {self.path}: {error.strerror or error}")


def _may_write(path):
    """A rename would replace a file that its owner has protected."""
    effective = os.access in os.supports_effective_ids
    return os.access(path, os.W_OK, effective_ids=effective)


def _flush_folder(folder):
    """Make the rename itself survive a power cut, where folders can be opened at all."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
