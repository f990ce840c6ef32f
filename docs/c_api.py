#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Draws the C reference from the public header:  docs/c_api.py [--check]

Writes docs/c-api.md; with --check it says whether that file is as the header is. The header is the
manual: a wrong sentence is mended there.
"""

import re
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEADER = ROOT / "libcore" / "include" / "exemplar.h"
OUTPUT = ROOT / "docs" / "c-api.md"

SECTION = re.compile(r"^/\* -{10,} (.+) \*/$")
# A row of a description: a name or a few, two spaces, what it is.
ROW = re.compile(r"^(\w[\w, ]*?) {2,}(\S.*)$")


def chunks(text):
    """("section", title) and ("item", comment lines, code lines) in the order of the header."""
    comment, code, depth = [], [], 0
    lines = iter(text.splitlines())
    for line in lines:
        title = SECTION.match(line)
        if title and not depth:
            yield ("section", title[1])
        elif line.startswith("/**") and not depth:
            comment = [line]
            while "*/" not in comment[-1]:
                comment.append(next(lines))
        elif code or re.match(r"(typedef|EXM_API|#define EXM_[A-Z_0-9]+ )", line):
            code.append(line)
            depth += line.count("{") - line.count("}")
            if depth == 0 and (line.rstrip().endswith(";") or line.startswith("#define")):
                yield ("item", comment, code)
                comment, code = [], []


def plain(comment):
    """The text of a comment without its stars."""
    text = "\n".join(comment).removeprefix("/**").removesuffix("*/")
    lines = [re.sub(r"^ ?\*(?: |$)", "", line) for line in text.splitlines()]
    return [line.rstrip() for line in lines]


def described(lines):
    """Markdown of a comment: paragraphs, and tables of the parameters."""
    out, row = [], None
    for line in [*lines, ""]:
        match = ROW.match(line.strip() if not line.startswith("   ") else "")
        if match:
            if row is None:
                out += ["", "| | |", "|---|---|"]
            row = [match[1], match[2]]
            out.append(row)
        elif row is not None and line.startswith("   "):
            row[1] += " " + line.strip()
        else:
            row = None
            out.append(line.strip())
    text = [f"| `{r[0]}` | {escaped(r[1])} |" if isinstance(r, list) else escaped(r) for r in out]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(text)).strip()


def escaped(text):
    return text if text.startswith("|") else text.replace("<", "&lt;").replace("|", "\\|")


def name_of(code):
    """What a declaration declares: a macro, a type, a function."""
    text = " ".join(code)
    if text.startswith("#define"):
        return re.match(r"#define (\w+)", text)[1]
    if text.startswith("typedef"):
        pointer = re.search(r"\(\*(\w+)\)", text)
        return pointer[1] if pointer else re.search(r"(\w+);$", text)[1]
    return re.search(r"(\w+)\(", text.removeprefix("EXM_API"))[1]


def introduction(text):
    """The conventions and papers, as the header states them at its head."""
    head = text[: text.index("*/")]
    lines = [re.sub(r"^ \* ?", "", line) for line in head.splitlines()[2:]]
    return "\n".join(lines).strip()


def draw(text):
    out = [
        "# C reference",
        "",
        "Drawn from [`exemplar.h`](../libcore/include/exemplar.h) by `docs/c_api.py`; mend the",
        "header, not this page. A program of a page: [examples/c/pose.c](../examples/c/pose.c).",
        "",
        "```",
        introduction(text),
        "```",
    ]
    for kind, *rest in chunks(text):
        if kind == "section":
            out += ["", f"## {rest[0][0].upper()}{rest[0][1:]}"]
            continue
        comment, code = rest
        if comment:
            out += ["", f"### `{name_of(code)}`", "", described(plain(comment)), "", "```c"]
        elif out[-1] == "```" and len(out) > 8:
            out.pop()
        else:
            out += ["", "```c"]
        out += [*code, "```"]
    return "\n".join(out) + "\n"


def main():
    text = draw(HEADER.read_text(encoding="utf-8"))
    if "--check" in sys.argv[1:]:
        if not OUTPUT.is_file() or OUTPUT.read_text(encoding="utf-8") != text:
            sys.exit("docs/c-api.md is not as exemplar.h is: run docs/c_api.py")
        return
    OUTPUT.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
