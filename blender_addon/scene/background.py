# SPDX-License-Identifier: GPL-3.0-or-later
"""Work in a thread, so that Blender can show its progress and Esc can end it."""

import threading

from ..native import ExemplarError

_running = []


class BackgroundJob:
    """A thread that touches arrays and the library only, nothing of Blender's.

    work  called with report(fraction, stage), which returns True when the work should stop
    drop  called with the result of a job that is cancelled too late
    """

    def __init__(self, work, drop=None):
        self.fraction = 0.0
        self.stage = ""
        self._work = work
        self._drop = drop
        self._result = None
        self._error = None
        self._cancelled = False
        self._thread = threading.Thread(target=self._run, name="Exemplar work", daemon=True)
        _running.append(self)
        self._thread.start()

    def _run(self):
        try:
            self._result = self._work(self._report)
        except Exception as error:
            self._error = error

    def _report(self, fraction, stage):
        self.fraction, self.stage = fraction, stage
        return self._cancelled

    @property
    def finished(self):
        return not self._thread.is_alive()

    def result(self):
        """What the work returned, once finished; raises what went wrong."""
        self._close()
        if self._error is not None:
            raise self._error
        return self._result

    def ask_to_stop(self):
        """The library looks up now and then; until it has, the thread goes on."""
        self._cancelled = True

    @property
    def is_stopping(self):
        return self._cancelled

    def cancel(self):
        """Wait for the thread to notice, and drop what it made."""
        self._cancelled = True
        self._close()
        if self._error is None and self._drop is not None:
            self._drop(self._result)
        self._result = None
        if self._error is not None and not isinstance(self._error, ExemplarError):
            raise self._error

    def _close(self):
        self._thread.join()
        if self in _running:
            _running.remove(self)


def running():
    return bool(_running)


def cancel_all():
    """Before the add-on goes."""
    for job in list(_running):
        job.cancel()
