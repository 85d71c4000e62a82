#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks of the documents.

  check_links.py ROOT          relative links and images of all Markdown files lead to files of the project, anchors to headings;
                               README.md has at most 80 lines; every folder with source files has a README.md
  check_links.py --self-test   all of it on a tree with planted violations
"""
import re
import sys
import tempfile
from pathlib import Path, PurePosixPath

from source_tree import plant, project_files, run_check

LONGEST_README = 80  # lines of the first page
SOURCE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".py", ".sh"}
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(\s*<?([^)\s>]+)>?(?:\s+\"[^\"]*\")?\s*\)")
SCHEME = re.compile(r"^[a-z][a-z0-9+.-]*:", re.IGNORECASE)


def prose(text):
    """(line number, line) without code: neither fences nor what stands between back ticks is a link."""
    fence = None
    for number, line in enumerate(text.splitlines(), 1):
        mark = re.match(r"\s*(```+|~~~+)", line)
        if mark:
            fence = None if fence and mark[1].startswith(fence) else fence or mark[1]
        elif not fence:
            yield number, line


def anchor(heading):
    """The anchor that GitHub gives a heading."""
    text = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading.strip().rstrip("#").strip())
    text = re.sub(r"[^\w\- ]", "", text.replace("`", "").lower())
    return text.replace(" ", "-")


def anchors(text):
    """All anchors of a page: headings, repeated ones with a number, and names given in HTML."""
    found, count = set(), {}
    for _, line in prose(text):
        match = re.match(r"#{1,6}\s+(.*)", line)
        if match:
            name = anchor(match[1])
            found.add(name if name not in count else f"{name}-{count[name]}")
            count[name] = count.get(name, 0) + 1
        found.update(re.findall(r"<a (?:id|name)=\"([^\"]+)\"", line))
    return found


def normalised(path):
    """The path without . and .., or None outside of the project."""
    parts = []
    for part in path.parts:
        if part == "..":
            if not parts:
                return None
            parts.pop()
        elif part != ".":
            parts.append(part)
    return PurePosixPath(*parts)


def broken_links(root):
    """One line for each link that leads nowhere, and the number of links."""
    files = {PurePosixPath(name.as_posix()) for name in project_files(root)}
    folders = {parent for name in files for parent in name.parents}
    pages = {name: (Path(root) / name).read_text(encoding="utf-8") for name in sorted(files) if name.suffix == ".md"}
    found, count = [], 0
    for page, text in pages.items():
        for number, line in prose(text):
            for target in LINK.findall(re.sub(r"`[^`]*`", "code", line)):
                if SCHEME.match(target):
                    continue
                count += 1
                path, _, name = target.partition("#")
                aim = normalised(page.parent / path) if path else page
                if aim is None or (aim not in files and aim not in folders):
                    found.append(f"{page}:{number}: {target}: no such file")
                elif name and aim in pages and name not in anchors(pages[aim]):
                    found.append(f"{page}:{number}: {target}: {aim} has no such heading")
    return found, count


def long_readme(root):
    """The first page is short."""
    path = Path(root) / "README.md"
    lines = len(path.read_text(encoding="utf-8").splitlines()) if path.exists() else 0
    if not 0 < lines <= LONGEST_README:
        yield f"README.md: {lines} lines, it has 1 to {LONGEST_README}"


def folders_without_readme(root):
    """Every folder that holds source files says in a README.md what it is. Folders with a dot are not part of the tour."""
    files = {name.as_posix() for name in project_files(root)}
    folders = {name.parent for name in project_files(root) if name.suffix in SOURCE_SUFFIXES}
    for folder in sorted(folders):
        if not any(part.startswith(".") for part in folder.parts) and (folder / "README.md").as_posix() not in files:
            yield f"{folder}: has source files, but no README.md"


def violations(root):
    links, count = broken_links(root)
    return links + list(long_readme(root)) + list(folders_without_readme(root)), count


GOOD_TREE = {
    "README.md": "# Top\n[page](docs/page.md#two-words-a-b) ![x](docs/a.png) [web](https://x.org) `[no](link)`\n[here](#top)\n",
    "docs/page.md": "# Page\n```\n[no](link.md)\n```\n## Two words: `a` (b)\n[up](../README.md) [folder](../docs) [again](#page-1)\n"
                    "## Page\n",
    "docs/a.png": "x", "a/README.md": "# a\n", "a/good.h": "\n", ".b/run.py": "\n",
}
PLANTED = [
    ("README.md", GOOD_TREE["README.md"] + "[x](nowhere.md)\n", "README.md:4"),
    ("README.md", GOOD_TREE["README.md"] + "[x](docs/page.md#three-words)\n", "README.md:4"),
    ("README.md", GOOD_TREE["README.md"] + "\n" * LONGEST_README, "README.md: "),
    ("docs/page.md", GOOD_TREE["docs/page.md"] + "![x](b.png)\n", "docs/page.md:8"),
    ("docs/page.md", GOOD_TREE["docs/page.md"] + "[x](../../out.md)\n", "docs/page.md:8"),
    ("docs/page.md", GOOD_TREE["docs/page.md"] + "[x](#page-2)\n", "docs/page.md:8"),
    ("b/bare.cpp", "\n", "b: "),
]


def self_test():
    """Each planted line must give exactly one violation, the tree without it none."""
    failures = 0
    for file, text, start in [(None, "", "")] + PLANTED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, GOOD_TREE)
            if file:
                plant(root, {file: text})
            found, _ = violations(root)
        good = len(found) == 1 and found[0].startswith(start) if file else not found
        failures += not good
        print("ok  " if good else "FAIL", file or "clean tree", "->", found)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(run_check(__doc__, violations, self_test, "links"))
