# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs the tests of one file and prints a line for each: see tests/README.md.

    if __name__ == "__main__":
        support.run(globals())
"""

import os
import sys
import traceback
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# Where tests/run.sh built. EXEMPLAR_LIBRARY is what the add-on looks at, too.
LIBRARY = Path(os.environ.get("EXEMPLAR_LIBRARY", ROOT / "build" / "plain" / "libexemplar.so"))


def data(name):
    """The path of a real mesh; skips the running test where the data is not there."""
    path = Path(os.environ.get("EXEMPLAR_DATA", ROOT / ".." / "shared" / "data")) / name
    if not path.exists():
        raise unittest.SkipTest("the real meshes are not here (EXEMPLAR_DATA)")
    return path


class _Lines(unittest.TestResult):
    """A line a test. Sub-tests that fail are shown, and fail their test once."""

    def __init__(self, prefix, before_each):
        super().__init__()
        self.prefix = prefix
        self.before_each = before_each
        self.failed = False

    def startTest(self, test):
        self.failed = False
        if self.before_each:
            self.before_each()
        super().startTest(test)

    def stopTest(self, test):
        if self.failed:
            self._say("FAIL", test)
        super().stopTest(test)

    def _say(self, word, test, why=None):
        name = f"{self.prefix}{name_of(test)}"
        print(f"{word} {name}" if why is None else f"{word} {name}: {why}", flush=True)

    def _show(self, test, error):
        text = "".join(traceback.format_exception(*error))
        print("".join(f"  {line}\n" for line in text.splitlines()), end="")
        self.failed = True

    def addSuccess(self, test):
        if not self.failed:
            self._say("ok", test)

    def addSkip(self, test, reason):
        self._say("skip", test, reason)

    def addFailure(self, test, error):
        self._show(test, error)

    def addError(self, test, error):
        self._show(test, error)
        if not isinstance(test, unittest.TestCase):  # setUpClass and the like: no test is running
            self._say("FAIL", test)

    def addSubTest(self, test, subtest, error):
        if error is not None:
            print(f"  in {subtest}")
            self._show(test, error)

    def addExpectedFailure(self, test, error):
        self._say("ok", test)

    def addUnexpectedSuccess(self, test):
        self.failed = True


def name_of(test):
    """test_file.py's Class.test_this is Class.this."""
    parts = test.id().split(".")
    if isinstance(test, unittest.FunctionTestCase) or not isinstance(test, unittest.TestCase):
        parts = parts[-1:]
    return ".".join(part.removeprefix("test_") for part in parts[-2:])


def _tests(namespace):
    loader = unittest.defaultTestLoader
    for name, value in namespace.items():
        if isinstance(value, type) and issubclass(value, unittest.TestCase):
            yield from loader.loadTestsFromTestCase(value)
        elif name.startswith("test_") and callable(value):
            yield unittest.FunctionTestCase(value)


def run(namespace, before_each=None):
    """Run every function test_* and every unittest.TestCase of a module: run(globals()).

    Raise unittest.SkipTest to skip. Prints "end" at last, so that a crash is noticed.
    """
    file_name = Path(namespace["__file__"]).stem.removeprefix("test_")
    prefix = f"{os.environ.get('EXM_TEST_PREFIX', '')}{file_name}."
    pattern = os.environ.get("EXM_TEST_PATTERN", "")
    chosen = [test for test in _tests(namespace) if pattern in f"{prefix}{name_of(test)}"]
    # A suite, for it is what calls setUpClass.
    unittest.TestSuite(chosen).run(_Lines(prefix, before_each))
    print("end", flush=True)
    sys.stdout.flush()
