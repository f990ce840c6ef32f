# SPDX-License-Identifier: GPL-3.0-or-later
"""A page to draw on, written as SVG and, with numpy alone, as PNG."""

import struct
import zlib

import numpy as np

# Letters as strokes on a grid 4 wide and 6 high, baseline at 0: pen-down runs of "xy" pairs.
STROKES = {
    "0": "10 01 05 16 36 45 41 30 10",
    "1": "15 26 20|10 30",
    "2": "05 16 36 45 44 00 40",
    "3": "05 16 36 45 44 33 13|33 42 41 30 10 01",
    "4": "30 36 02 42",
    "5": "46 06 03 13 33 42 41 30 10 01",
    "6": "36 16 05 01 10 30 41 42 33 13 02",
    "7": "06 46 10",
    "8": "13 04 05 16 36 45 44 33 13 02 01 10 30 41 42 33",
    "9": "10 30 41 45 36 16 05 04 13 33 44",
    "a": "34 30|33 24 14 03 01 10 20 31",
    "b": "06 00|03 14 24 33 31 20 10 01",
    "c": "33 24 14 03 01 10 20 31",
    "d": "36 30|33 24 14 03 01 10 20 31",
    "e": "02 32 33 24 14 03 01 10 20 31",
    "f": "36 26 15 10|04 24",
    "g": "34 30 2a 1a 0b|33 24 14 03 01 10 20 31",
    "h": "06 00|03 14 24 33 30",
    "i": "14 10|16 15",
    "j": "24 20 1a 0a|26 25",
    "k": "06 00|34 02 30",
    "l": "16 11 20",
    "m": "04 00|03 14 23 20|23 34 43 40",
    "n": "04 00|03 14 24 33 30",
    "o": "10 01 03 14 24 33 31 20 10",
    "p": "04 0b|03 14 24 33 31 20 10 01",
    "q": "34 3b|33 24 14 03 01 10 20 31",
    "r": "04 00|02 14 24",
    "s": "34 14 03 12 22 31 20 00",
    "t": "16 11 20 30|04 24",
    "u": "04 01 10 20 31|34 30",
    "v": "04 20 44",
    "w": "04 10 24 30 44",
    "x": "04 30|34 00",
    "y": "04 20|44 1b",
    "z": "04 34 00 30",
    ".": "10 11",
    ",": "11 10 0a",
    ":": "10 11|13 14",
    "-": "03 33",
    "=": "02 32|04 34",
    "(": "26 14 12 20",
    ")": "06 14 12 00",
    "/": "00 46",
    "%": "00 46|05 16 14 05|31 40 42 31",
}
BELOW = {"a": -1, "b": -2}  # y below the baseline


class Page:
    """Shapes in drawing order; x to the right, y down, in pixels of a width x height page."""

    def __init__(self, width, height):
        self.width, self.height, self.shapes = width, height, []

    def polygon(self, points, fill, opacity=1.0):
        self.shapes.append(("polygon", np.asarray(points, dtype=float), fill, opacity))

    def line(self, points, colour, width=1.5):
        self.shapes.append(("line", np.asarray(points, dtype=float), colour, width))

    def disc(self, centre, radius, fill):
        angles = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
        circle = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        self.polygon(np.asarray(centre) + radius * circle, fill)

    def text(self, place, words, size=13, colour=(0.2, 0.2, 0.2), bold=False):
        """`place` is where the baseline begins."""
        self.shapes.append(("text", np.asarray(place, dtype=float), words, size, colour, bold))

    # ------------------------------------------------------------------------------------- SVG

    def write_svg(self, path):
        size = f'width="{self.width}" height="{self.height}"'
        box = f'viewBox="0 0 {self.width} {self.height}"'
        lines = [f'<svg xmlns="http://www.w3.org/2000/svg" {size} {box}>']
        lines.append('<rect width="100%" height="100%" fill="white"/>')
        lines += [getattr(self, "_svg_" + shape[0])(*shape[1:]) for shape in self.shapes]
        with open(path, "w", encoding="utf-8") as file:
            file.write("\n".join(lines + ["</svg>", ""]))

    def _svg_polygon(self, points, fill, opacity):
        return f'<polygon points="{_pairs(points)}" fill="{_hex(fill)}" opacity="{opacity:g}"/>'

    def _svg_line(self, points, colour, width):
        style = f'fill="none" stroke="{_hex(colour)}" stroke-width="{width:g}"'
        return f'<polyline points="{_pairs(points)}" {style} stroke-linejoin="round"/>'

    def _svg_text(self, place, words, size, colour, bold):
        style = f'font-family="sans-serif" font-size="{size}" fill="{_hex(colour)}"'
        weight = ' font-weight="bold"' if bold else ""
        return f'<text x="{place[0]:.1f}" y="{place[1]:.1f}" {style}{weight}>{words}</text>'

    # ------------------------------------------------------------------------------------- PNG

    def write_png(self, path, scale=2):
        image = np.ones((self.height * scale, self.width * scale, 3))
        for shape in self.shapes:
            getattr(self, "_png_" + shape[0])(image, scale, *shape[1:])
        write_png(path, np.round(255.0 * np.clip(image, 0.0, 1.0)).astype(np.uint8))

    def _png_polygon(self, image, scale, points, fill, opacity):
        _paint(image, points * scale, 1.0, fill, opacity, _inside)

    def _png_line(self, image, scale, points, colour, width):
        half = 0.5 * width * scale
        for piece in zip(points[:-1] * scale, points[1:] * scale):
            _paint(image, np.array(piece), half + 1.0, colour, 1.0, _near, half)

    def _png_text(self, image, scale, place, words, size, colour, bold):
        unit, x = size / 8.5, place[0]
        for letter in words.lower():
            reach = 0.0
            for run in filter(None, STROKES.get(letter, "").split("|")):
                pen = [
                    (int(p[0]), BELOW[p[1]] if p[1] in BELOW else int(p[1])) for p in run.split()
                ]
                pen = np.array(pen, dtype=float)
                reach = max(reach, pen[:, 0].max())
                points = [x, place[1]] + unit * pen * [1.0, -1.0]
                self._png_line(image, scale, points, colour, size / (7.0 if bold else 10.0))
            x += unit * (reach + 1.6 if reach else 2.6)


def _pairs(points):
    return " ".join(f"{x:.2f},{y:.2f}" for x, y in points)


def _hex(colour):
    return "#" + "".join(f"{round(255 * channel):02x}" for channel in colour)


def _paint(image, points, margin, colour, opacity, coverage, *arguments):
    """Blend `colour` into the pixels around `points` by coverage(pixel centres, points, ...)."""
    low = np.maximum(np.floor(points.min(axis=0) - margin), 0).astype(int)
    high = np.minimum(np.ceil(points.max(axis=0) + margin), image.shape[1::-1]).astype(int)
    if (high <= low).any():
        return
    x, y = np.meshgrid(np.arange(low[0], high[0]) + 0.5, np.arange(low[1], high[1]) + 0.5)
    share = opacity * coverage(x, y, points, *arguments)[..., None]
    window = image[low[1] : high[1], low[0] : high[0]]
    window += share * (np.array(colour) - window)


def _inside(x, y, points):
    """Even-odd rule at four places of each pixel."""
    covered = np.zeros(x.shape)
    for dx, dy in ((-0.375, -0.125), (0.125, -0.375), (0.375, 0.125), (-0.125, 0.375)):
        odd = np.zeros(x.shape, dtype=bool)
        for (ax, ay), (bx, by) in zip(points, np.roll(points, -1, axis=0)):
            if ay != by:
                spans = (ay > y + dy) != (by > y + dy)
                odd ^= spans & (x + dx < ax + (y + dy - ay) * (bx - ax) / (by - ay))
        covered += 0.25 * odd
    return covered


def _near(x, y, ends, half):
    """Within `half` of a segment, softened over a pixel."""
    (ax, ay), (bx, by) = ends
    length = max((bx - ax) ** 2 + (by - ay) ** 2, 1e-12)
    along = np.clip(((x - ax) * (bx - ax) + (y - ay) * (by - ay)) / length, 0.0, 1.0)
    distance = np.hypot(x - ax - along * (bx - ax), y - ay - along * (by - ay))
    return np.clip(half + 0.5 - distance, 0.0, 1.0)


def write_png(path, image):
    """image: uint8 [height][width][3]"""
    height, width, _ = image.shape
    rows = np.hstack([np.zeros((height, 1), np.uint8), image.reshape(height, -1)])
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = (b"IHDR", header), (b"IDAT", zlib.compress(rows.tobytes(), 6)), (b"IEND", b"")
    with open(path, "wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        for kind, data in chunks:
            check = struct.pack(">I", zlib.crc32(kind + data))
            file.write(struct.pack(">I", len(data)) + kind + data + check)
