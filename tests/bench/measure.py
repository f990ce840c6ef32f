# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows, medians, and the programs that a row is measured with."""

import json
import statistics
import subprocess
import threading
import time
import traceback

from inputs import Missing

PREFIX = "="  # what a worker answers begins so; everything else it prints is chatter
PATIENCE = 300  # seconds for one answer


class Bench:
    """Collects rows. Areas ask it what is wanted, and how much."""

    def __init__(self, pattern, quick, build):
        self.pattern = pattern
        self.quick = quick
        self.build = build  # where programs were built and files may be left
        self.rows = []
        self.skipped = []
        self.failed = []

    def wants(self, name):
        return self.pattern in name

    def repeats(self, full, quick):
        return quick if self.quick else full

    def add(self, name, ours, peer, unit, peer_name, notes="", is_printed=False):
        """is_printed: the peer was not measured here; a paper or a target states it."""
        if not self.wants(name):
            return
        row = {
            "name": name,
            "ours": ours,
            "peer": peer_name if is_printed else peer,
            "unit": unit,
            "ratio": peer / ours,
            "peer_name": peer_name,
            "peer_value": peer,
        }
        if notes:
            row["notes"] = notes
        self.rows.append(row)
        print(line_of(row), flush=True)

    def run(self, names, measure):
        """Measure the rows `names` with measure(self), unless nobody wants any of them."""
        wanted = [name for name in names if self.wants(name)]
        if not wanted:
            return
        why = None
        try:
            measure(self)
        except Missing as error:
            why = str(error)
            self.skipped += self._left_of(wanted)
        except Exception:
            traceback.print_exc()
            why = "the measurement failed, as above"
            self.failed += self._left_of(wanted)
        for name in self._left_of(wanted):
            print(f"skip {name}: {why or 'its peer is not there'}", flush=True)

    def _left_of(self, names):
        done = {row["name"] for row in self.rows}
        return [name for name in names if name not in done]

    def write(self, path):
        with open(path, "w") as file:
            json.dump(self.rows, file, indent=1)
            file.write("\n")


def line_of(row):
    return (
        f"{row['name']:<36} {number(row['ours']):>9} {number(row['peer_value']):>9} "
        f"{row['unit']:<4} {number(row['ratio']):>8}x  {row['peer_name']}"
    )


HEADER = f"{'name':<36} {'ours':>9} {'peer':>9} {'unit':<4} {'ratio':>9}  peer is"


def number(value):
    """Three digits that count."""
    return f"{value:.0f}" if value >= 1000 else f"{value:#.3g}".rstrip(".")


# ------------------------------------------------------------------------------------ timing


clock = time.process_time  # what other programs take of the machine is left out; see run.sh


def timed(function, *arguments, **options):
    """A function that calls and returns the seconds it took."""

    def run():
        start = clock()
        function(*arguments, **options)
        return clock() - start

    return run


def interleave(repeats, *measurements, burst=1):
    """Medians of measurements taken in turns, so that a machine that drifts drifts for all.

    Each measurement is a function that returns seconds. `burst` of them follow each other before
    it is the next one's turn: small ones would else always meet the caches of the others.
    """
    found = samples(repeats, *measurements, burst=burst)
    return [statistics.median(values) for values in found]


def samples(repeats, *measurements, burst=1):
    found = [[] for _ in measurements]
    done = 0
    while done < repeats:
        count = min(burst, repeats - done)
        for values, measure in zip(found, measurements):
            values += [measure() for _ in range(count)]
        done += count
    return found


# ----------------------------------------------------------------------------------- workers


class Worker:
    """A program that measures on request: it says it is ready, then answers each line of its
    standard input with numbers."""

    def __init__(self, *command):
        self.command = [str(part) for part in command]
        self.process = subprocess.Popen(
            self.command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        try:
            self._answer()
        except BaseException:
            self.process.kill()
            raise

    def ask(self, command):
        """The numbers answered."""
        self.process.stdin.write(command + "\n")
        self.process.stdin.flush()
        return self._answer()

    def seconds(self, command):
        """A measurement for interleave(): the first number answered."""
        return lambda: self.ask(command)[0]

    def _answer(self):
        chatter = []
        watchdog = threading.Timer(PATIENCE, self.process.kill)
        watchdog.start()
        try:
            for line in self.process.stdout:
                if line.startswith(PREFIX):
                    return [float(word) for word in line[len(PREFIX) :].split()]
                chatter.append(line)
        finally:
            watchdog.cancel()
        raise RuntimeError(f"{self.command[0]} ended early:\n{''.join(chatter[-20:])}")

    def __enter__(self):
        return self

    def __exit__(self, *_error):
        self.process.stdin.close()
        try:
            self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
        self.process.stdout.close()
