# SPDX-License-Identifier: GPL-3.0-or-later
"""The library exports what the header declares, and nothing else."""

import re
import subprocess

import support

HEADER = support.ROOT / "libcore" / "include" / "exemplar.h"


def declared():
    text = re.sub(r"/\*.*?\*/", "", HEADER.read_text(), flags=re.DOTALL)
    return set(re.findall(r"\bEXM_API\s[^;(]*?\b(exm_\w+)\s*\(", text))


def exported():
    output = subprocess.run(
        ["nm", "-D", "--defined-only", str(support.LIBRARY)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout
    return {line.split()[-1] for line in output.splitlines()}


def test_every_declared_function_is_exported():
    names = declared()
    assert len(names) > 10
    assert not names - exported(), f"declared, not exported: {sorted(names - exported())}"


def test_nothing_else_is_exported():
    others = exported() - declared()
    assert not others, f"exported, not declared: {sorted(others)}"


def test_file_is_named_after_the_abi():
    version = re.search(r"#define EXM_ABI_VERSION (\d+)", HEADER.read_text())[1]
    output = subprocess.run(
        ["readelf", "-d", str(support.LIBRARY)], check=True, capture_output=True, text=True
    ).stdout
    assert f"[libexemplar.so.{version}]" in output


if __name__ == "__main__":
    support.run(globals())
