# SPDX-License-Identifier: GPL-3.0-or-later
"""Measures everything and writes the rows: see docs/benchmarks.md. Started by run.sh."""

import argparse
import datetime
import os
import sys
import time
from pathlib import Path

# Before numpy is imported, here and in the programs that are started.
for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
    os.environ[variable] = "1"

import area_amrap  # noqa: E402
import area_blended  # noqa: E402
import area_blender  # noqa: E402
import area_cone  # noqa: E402
import area_registration  # noqa: E402
import area_rigidity  # noqa: E402
import area_rotation  # noqa: E402
import area_sequence  # noqa: E402
import area_skin  # noqa: E402
import area_sweep  # noqa: E402
import area_weights  # noqa: E402
from measure import HEADER, Bench  # noqa: E402

AREAS = (
    area_amrap,
    area_registration,
    area_rigidity,
    area_blended,
    area_weights,
    area_cone,
    area_rotation,
    area_skin,
    area_sequence,
    area_blender,
    area_sweep,
)


def processor():
    for line in Path("/proc/cpuinfo").read_text().splitlines():
        if line.startswith("model name"):
            return line.split(":", 1)[1].strip()
    return "an unknown processor"


def main():
    parser = argparse.ArgumentParser(prog="tests/bench/run.sh", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer repeats, shorter sweeps")
    parser.add_argument("-k", metavar="PATTERN", default="", help="rows whose name contains it")
    parser.add_argument("--json", metavar="FILE", required=True, help="where the rows go")
    parser.add_argument("--build", type=Path, required=True, help=argparse.SUPPRESS)
    options = parser.parse_args()
    bench = Bench(options.k, options.quick, options.build)
    start = time.monotonic()
    print(f"{datetime.date.today()}, {processor()}, one thread, processor time")
    print(HEADER, flush=True)
    for area in AREAS:
        area.run(bench)
    bench.write(options.json)
    print(
        f"{len(bench.rows)} rows, {len(bench.skipped)} skipped, {len(bench.failed)} failed, "
        f"{time.monotonic() - start:.0f} s"
    )
    return 1 if bench.failed else 0


if __name__ == "__main__":
    sys.exit(main())
