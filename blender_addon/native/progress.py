# SPDX-License-Identifier: GPL-3.0-or-later
"""Progress callbacks."""

from .declarations import Progress
from .errors import ExemplarError


class ProgressCallback:
    """`report(fraction, stage)` for the library to call; it cancels by returning True.

    No exception may pass through C: one is kept, cancels the call, and is raised when that is over.
    """

    def __init__(self, report=None):
        self._report = report
        self._failure = None
        self.function = Progress(self._call) if report else Progress()

    def _call(self, _user, fraction, stage):
        try:
            return 1 if self._report(fraction, (stage or b"").decode("utf-8", "replace")) else 0
        except BaseException as failure:
            self._failure = failure
            return 1

    def __enter__(self):
        return self.function

    def __exit__(self, _kind, error, _trace):
        if self._failure and (error is None or isinstance(error, ExemplarError)):
            raise self._failure
