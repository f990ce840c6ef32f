# SPDX-License-Identifier: GPL-3.0-or-later
"""The manual: links that lead somewhere, pictures of a bearable size, a C reference that is as the
header is.
"""

import re
import subprocess
import sys

import support

PAGES = [
    *support.ROOT.glob("*.md"),
    *support.ROOT.glob("docs/*.md"),
    support.ROOT / "tests/README.md",
]
LARGEST = 200_000  # bytes a picture


def links(page):
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S)
    return re.findall(r"\]\(([^)\s]+)\)", text)


def anchors(page):
    """As GitHub makes them of headings."""
    found = set()
    for title in re.findall(r"^#+ (.+)$", page.read_text(encoding="utf-8"), re.M):
        plain = re.sub(r"[^\w\- ]", "", title.lower())
        found.add(plain.replace(" ", "-"))
    return found


def test_every_link_leads_somewhere():
    for page in PAGES:
        for link in links(page):
            if link.startswith(("http:", "https:")):
                continue
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            assert target.exists(), f"{page.name}: {link}"
            if anchor:
                assert anchor in anchors(target), f"{page.name}: {link}"


def test_every_page_is_reached_from_the_first():
    index = set(links(support.ROOT / "docs" / "README.md"))
    for page in support.ROOT.glob("docs/*.md"):
        assert page.name == "README.md" or page.name in index, page.name


def test_pictures_are_used_and_small():
    shown = {
        link.split("/")[-1]
        for page in PAGES
        for link in links(page)
        if link.endswith((".png", ".svg", ".jpg"))
    }
    for picture in support.ROOT.glob("docs/images/*"):
        assert picture.stat().st_size < LARGEST, picture.name
        assert picture.name in shown, f"{picture.name} is on no page"


def test_c_reference_is_as_the_header():
    done = subprocess.run(
        [sys.executable, support.ROOT / "docs" / "c_api.py", "--check"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr


def test_c_reference_has_every_function():
    header = (support.ROOT / "libcore" / "include" / "exemplar.h").read_text()
    page = (support.ROOT / "docs" / "c-api.md").read_text()
    functions = re.findall(r"^EXM_API [\w \*]*?\*?(exm_\w+)\(", header, re.M)
    assert len(functions) > 30
    for name in functions:
        assert f"{name}(" in page, name


if __name__ == "__main__":
    support.run(globals())
