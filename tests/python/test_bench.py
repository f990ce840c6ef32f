# SPDX-License-Identifier: GPL-3.0-or-later
"""The benchmarks' front door and the form of their rows; speeds are not asserted anywhere."""

import contextlib
import io
import json
import subprocess
import sys
import tempfile
from pathlib import Path

import support

BENCH = support.ROOT / "tests" / "bench"
sys.path.insert(0, str(BENCH))

from inputs import Missing  # noqa: E402
from measure import Bench  # noqa: E402


def run(*arguments):
    command = [str(BENCH / "run.sh"), *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd="/")


@contextlib.contextmanager
def quietly():
    """What a measurement prints could be taken for the results of tests."""
    with contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(io.StringIO()):
        yield


def test_help_says_how():
    found = run("--help")
    assert found.returncode == 0, found.stderr
    assert "--json FILE" in found.stdout


def test_usage_errors_have_an_exit_status():
    assert run("--quick").returncode == 2
    found = run("--slow", "--json", "rows.json")
    assert found.returncode == 2 and "--slow" in found.stderr


def test_rows_as_written():
    bench = Bench("cone", quick=True, build=None)
    with quietly():
        bench.add("cone/small/solve", 2.0, 3.0, "ms", "another solver", "a note")
        bench.add("cone/paper/solve", 2.0, 50.0, "ms", "a table: 50 ms", is_printed=True)
        bench.add("skin/50k/apply", 1.0, 1.0, "ms", "nobody asked for it")
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "rows.json"
        bench.write(path)
        measured, printed = json.loads(path.read_text())
    assert measured["ratio"] == 1.5 and measured["peer"] == 3.0
    assert measured["notes"] == "a note" and measured["peer_name"] == "another solver"
    assert printed["ratio"] == 25.0 and printed["peer"] == "a table: 50 ms"
    assert printed["peer_value"] == 50.0


def test_what_is_missing_is_skipped_and_what_breaks_fails():
    bench = Bench("", quick=True, build=None)

    def missing(_bench):
        raise Missing("no such mesh")

    with quietly():
        bench.run(["a/b/c"], missing)
        bench.run(["d/e/f"], lambda _bench: 1 / 0)
    assert bench.skipped == ["a/b/c"] and bench.failed == ["d/e/f"] and not bench.rows


if __name__ == "__main__":
    support.run(globals())
