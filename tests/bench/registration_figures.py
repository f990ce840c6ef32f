# SPDX-License-Identifier: GPL-3.0-or-later
"""Figure 7 of the Blended paper and sweeps of robustness, as tables and pictures.

    /usr/bin/python3 tests/bench/registration_figures.py figure --runs 50 --data lion --out FOLDER
    /usr/bin/python3 tests/bench/registration_figures.py sweeps --runs 5 --data lion --out FOLDER

Each run is seeded by its number. Results are kept run by run in FOLDER, and a run that is there is
not made again. Reads EXEMPLAR_DATA and EXEMPLAR_LIBRARY.
"""

import argparse
import json
from pathlib import Path

import numpy
import registration_protocol as protocol

SHARES = numpy.linspace(0, 0.1, 41)
TABLE = (0.01, 0.02, 0.05, 0.1)
METHODS = {
    "q = 1": lambda case: protocol.ours(case, 1),
    "q = 2": lambda case: protocol.ours(case, 2),
    "q = 4": lambda case: protocol.ours(case, 4),
    "q = 8": lambda case: protocol.ours(case, 8),
    "rigid alignment": protocol.rigid,
    "ICP without exemplars": protocol.rigidity_alone,
}
SWEEPS = {
    "noise": [{"noise": value} for value in (0, 0.005, 0.01, 0.02)],
    "landmarks": [{"landmarks": value} for value in (3, 4, 6, 8, 12)],
    "surface": [{"share": value} for value in (0.3, 0.45, 0.6, 0.8, 1.0)],
    "scale": [{"scale": value} for value in (0.5, 0.75, 1.5, 2)],
    "wrong landmarks": [{"wrong": value} for value in (0, 1, 2)],
}
COLOURS = ("#9ecae1", "#5fa2d0", "#2b7bba", "#08306b", "#d1495b", "#2e8b57")


def curve(errors):
    """Percentages of errors within SHARES."""
    return [100 * float((errors <= share).mean()) for share in SHARES]


def run_figure(args, poses, faces):
    kept = {}
    for seed in range(args.first, args.runs):
        path = args.out / f"figure-{args.data}-{seed:03d}.json"
        if not path.exists():
            case = protocol.make(poses, faces, seed)
            found = {}
            for name, method in METHODS.items():
                outcome = method(case)
                found[name] = {
                    "deformation": curve(outcome.deformation),
                    "correspondence": curve(outcome.correspondence),
                    "mean": float(outcome.deformation.mean()),
                    "unseen": float(numpy.isinf(outcome.correspondence).mean()),
                }
            path.write_text(json.dumps(found))
            print(f"run {seed}", flush=True)
        kept[seed] = json.loads(path.read_text())
    for what in ("deformation", "correspondence"):
        print(f"\n{what}: percentage within a share of the target's size, {len(kept)} runs")
        print("| |" + "|".join(f" {share:g} " for share in TABLE) + "|")
        print("|---|" + "---|" * len(TABLE))
        for name in METHODS:
            mean = numpy.mean([run[name][what] for run in kept.values()], axis=0)
            cells = [mean[numpy.argmin(abs(SHARES - share))] for share in TABLE]
            print(f"| {name} |" + "|".join(f" {cell:.1f} " for cell in cells) + "|")
    picture(args.out / f"figure7-{args.data}.svg", kept)


def run_sweeps(args, poses, faces):
    print("| sweep | value | median error | mean | 95 % | quality | scale off | warned |")
    print("|---|---|---|---|---|---|---|---|")
    for name, settings in SWEEPS.items():
        for own in settings:
            value = next(iter(own.values()))
            path = args.out / f"sweep-{args.data}-{name.replace(' ', '-')}-{value:g}.json"
            if not path.exists():
                rows = []
                for seed in range(args.runs):
                    case = protocol.make(poses, faces, seed, **own)
                    outcome = protocol.ours(case, 8)
                    errors = outcome.deformation
                    rows.append(
                        {
                            "median": float(numpy.median(errors)),
                            "mean": float(errors.mean()),
                            "high": float(numpy.quantile(errors, 0.95)),
                            "quality": outcome.quality,
                            "scale": abs(outcome.scale / own.get("scale", 1) - 1),
                            "warning": outcome.warning,
                        }
                    )
                path.write_text(json.dumps(rows))
            rows = json.loads(path.read_text())
            mean = {k: numpy.mean([r[k] for r in rows]) for k in rows[0] if k != "warning"}
            warned = sum(bool(row["warning"]) for row in rows)
            print(
                f"| {name} | {value:g} | {mean['median']:.4f} | {mean['mean']:.4f} | "
                f"{mean['high']:.4f} | {mean['quality']:.2f} | {mean['scale']:.3f} | "
                f"{warned} of {len(rows)} |",
                flush=True,
            )


# --------------------------------------------------------------------------------------- picture

WIDTH, HEIGHT, LEFT, TOP, GAP = 340, 260, 60, 40, 60


def picture(path, kept):
    """Both curves as the paper draws them: percentages over distances."""
    width, height = 2 * (LEFT + WIDTH) + GAP, TOP + HEIGHT + 90
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    titles = {"deformation": "vertices", "correspondence": "correspondences"}
    for index, (what, unit) in enumerate(titles.items()):
        left = LEFT + index * (WIDTH + GAP)
        parts.append(f'<text x="{left}" y="{TOP - 14}">% of {unit} within a distance</text>')
        parts += _axes(left)
        for name, colour in zip(METHODS, COLOURS):
            mean = numpy.mean([run[name][what] for run in kept.values()], axis=0)
            line = " ".join(
                f"{left + WIDTH * s / SHARES[-1]:.1f},{TOP + HEIGHT * (1 - m / 100):.1f}"
                for s, m in zip(SHARES, mean)
            )
            parts.append(
                f'<polyline points="{line}" fill="none" stroke="{colour}" stroke-width="2"/>'
            )
    for index, (name, colour) in enumerate(zip(METHODS, COLOURS)):
        x, y = LEFT + index % 3 * 240, TOP + HEIGHT + 52 + 20 * (index // 3)
        parts.append(f'<path d="M{x} {y}h20" stroke="{colour}" stroke-width="2"/>')
        parts.append(f'<text x="{x + 26}" y="{y + 4}">{name}</text>')
    path.write_text("\n".join([*parts, "</svg>", ""]))


def _axes(left):
    yield f'<path d="M{left} {TOP}h{WIDTH}v{HEIGHT}h-{WIDTH}z" fill="none" stroke="#999"/>'
    for percent in range(0, 101, 20):
        y = TOP + HEIGHT * (1 - percent / 100)
        yield f'<path d="M{left} {y:.1f}h{WIDTH}" stroke="#ddd"/>'
        yield f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{percent}</text>'
    for share in (0, 0.02, 0.04, 0.06, 0.08, 0.1):
        x = left + WIDTH * share / SHARES[-1]
        yield f'<text x="{x:.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{share:g}</text>'


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=("figure", "sweeps"))
    parser.add_argument("--runs", type=int, default=50)
    parser.add_argument("--first", type=int, default=0, help="number of the first run")
    parser.add_argument("--data", default="lion")
    parser.add_argument("--out", type=Path, required=True)
    args = parser.parse_args()
    args.out.mkdir(parents=True, exist_ok=True)
    poses, faces = protocol.load(args.data)
    {"figure": run_figure, "sweeps": run_sweeps}[args.what](args, poses, faces)


if __name__ == "__main__":
    main()
