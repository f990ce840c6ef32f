# SPDX-License-Identifier: GPL-3.0-or-later
"""Rows as a table for docs/benchmarks.md:  /usr/bin/python3 tests/bench/table.py FILE [PATTERN]"""

import json
import sys

from measure import number


def main(path, pattern=""):
    with open(path) as file:
        rows = [row for row in json.load(file) if pattern in row["name"]]
    print("| row | ours | peer | unit | ratio | peer is |")
    print("|---|---|---|---|---|---|")
    for row in rows:
        cells = [number(row[key]) for key in ("ours", "peer_value")] + [row["unit"]]
        print(f"| {row['name']} | {' | '.join(cells)} | {number(row['ratio'])} |", end="")
        print(f" {row['peer_name']} |")


main(*sys.argv[1:])
