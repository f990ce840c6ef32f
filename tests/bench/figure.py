# SPDX-License-Identifier: GPL-3.0-or-later
"""The growth of costs as a table and as a picture: CSV, and an SVG of plain lines."""

import csv
import math

WIDTH, HEIGHT, LEFT, TOP, GAP = 300, 260, 60, 40, 50
COLOURS = ("#1b6ca8", "#d1495b", "#2e8b57", "#8a5a9e")


def write(stem, points, quantities):
    """points  [(sweep, size, {quantity: milliseconds})]; writes stem.csv and stem.svg"""
    with open(stem.with_suffix(".csv"), "w", newline="") as file:
        table = csv.writer(file)
        table.writerow(["sweep", "size", *(f"{what}_ms" for what in quantities)])
        for sweep, size, found in points:
            table.writerow([sweep, size, *(f"{found[what]:.4g}" for what in quantities)])
    stem.with_suffix(".svg").write_text(_svg(points, quantities))
    print(f"growth: {stem.name}.csv and {stem.name}.svg in the build folder", flush=True)


def _svg(points, quantities):
    sweeps = list(dict.fromkeys(sweep for sweep, *_ in points))
    values = [value for *_, found in points for value in found.values() if value > 0]
    low, high = math.floor(math.log10(min(values))), math.ceil(math.log10(max(values)))
    high = max(high, low + 1)
    width = LEFT + len(sweeps) * (WIDTH + GAP)
    height = TOP + HEIGHT + 70
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" '
        'font-family="sans-serif" font-size="12">',
        f'<rect width="{width}" height="{height}" fill="white"/>',
    ]
    for index, sweep in enumerate(sweeps):
        own = [(size, found) for name, size, found in points if name == sweep]
        left = LEFT + index * (WIDTH + GAP)
        parts += _panel(left, sweep, own, quantities, low, high)
    for index, what in enumerate(quantities):
        x, y = LEFT + index * 140, TOP + HEIGHT + 50
        parts.append(f'<path d="M{x} {y}h20" stroke="{COLOURS[index]}" stroke-width="2"/>')
        parts.append(f'<text x="{x + 26}" y="{y + 4}">{what}</text>')
    return "\n".join([*parts, "</svg>", ""])


def _panel(left, title, own, quantities, low, high):
    smallest, largest = math.log10(own[0][0]), math.log10(max(own[-1][0], own[0][0] * 1.01))

    def at(size, value):
        x = left + WIDTH * (math.log10(size) - smallest) / (largest - smallest)
        share = (math.log10(max(value, 10.0**low)) - low) / (high - low)
        return x, TOP + HEIGHT * (1 - share)

    yield f'<text x="{left}" y="{TOP - 14}">milliseconds by {title}</text>'
    yield f'<path d="M{left} {TOP}h{WIDTH}v{HEIGHT}h-{WIDTH}z" fill="none" stroke="#999"/>'
    for power in range(low, high + 1):
        _, y = at(own[0][0], 10.0**power)
        yield f'<path d="M{left} {y:.1f}h{WIDTH}" stroke="#ddd"/>'
        yield f'<text x="{left - 6}" y="{y + 4:.1f}" text-anchor="end">{10.0**power:g}</text>'
    for size, _ in own:
        x, _ = at(size, 1)
        yield f'<text x="{x:.1f}" y="{TOP + HEIGHT + 18}" text-anchor="middle">{size}</text>'
    for what, colour in zip(quantities, COLOURS):
        line = [at(size, found[what]) for size, found in own]
        path = " ".join(f"{x:.1f},{y:.1f}" for x, y in line)
        yield f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="2"/>'
        yield from (f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in line)
