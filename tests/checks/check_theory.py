#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The theory pages against the tree: their numbers, what cites them, and the files that they name.

  check_theory.py ROOT           exit code 1 and one line for each violation
  check_theory.py --self-test    plants one violation of each kind and must find it

Checked are: tags \\tag{page.number} are those of their page, unique and ascending; an equation that a comment cites as
"theory (5.3)", or a page as "(5.3)", exists; every page of equations names a source file and a file of tests/ that exist; every
path in backticks that looks like one of the repository exists.
"""
import re
import sys
import tempfile
from pathlib import Path

from source_tree import plant, project_files, run_check

PAGES = "docs/theory"
CODE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".py", ".sh", ".cmake"}
DISPLAY = re.compile(r"^\$\$\n(.*?)\n\$\$$", re.MULTILINE | re.DOTALL)
TAG = re.compile(r"\\tag\{([^}]*)\}")
NUMBER = re.compile(r"\((\d+)\.(\d+)\)")
CITATION = re.compile(r"\btheory((?:[\s,]+(?:and\s+|to\s+|-\s+)?\(\d+\.\d+\))+)", re.IGNORECASE)
# A comment goes on in the next line.
LINE_END = re.compile(r"[ \t]*\n[ \t]*(?://+[/!<]*|#+|\*)?[ \t]*")
PATH = re.compile(r"`((?:coupler|dem_side|fem_side|tests|docs|cases)/[^`\s]*)`")
SOURCE = re.compile(r"(?:coupler|dem_side|fem_side)/.*\.(?:h|cpp)$")


def pages_of(root):
    """(path, text) of each theory page, by name."""
    return [(name.as_posix(), (Path(root) / name).read_text(encoding="utf-8")) for name in project_files(root)
            if name.parent.as_posix() == PAGES and name.suffix == ".md"]


def tags_of(path, text):
    """The equation numbers of a page, (page, number), and what is wrong with them."""
    found, wrong = [], []
    page = re.match(r"\d+", Path(path).name)
    displayed = sum(len(TAG.findall(block)) for block in DISPLAY.findall(text))
    if displayed != len(TAG.findall(text)):
        wrong.append(f"{path}: a \\tag stands outside of $$ ... $$ on lines of their own")
    for tag in TAG.findall(text):
        number = NUMBER.fullmatch(f"({tag})")
        if page is None or number is None or int(number[1]) != int(page[0]):
            wrong.append(f"{path}: the tag {tag} is none of this page")
            continue
        key = (int(number[1]), int(number[2]))
        if found and key <= found[-1]:
            wrong.append(f"{path}: the tag {tag} does not ascend")
        found.append(key)
    return found, wrong


def wrong_citations(root, known):
    """Equations that comments of the code cite and no page has."""
    for name in project_files(root):
        if name.suffix not in CODE_SUFFIXES or name.name == Path(__file__).name:
            continue
        text = LINE_END.sub(" ", (Path(root) / name).read_text(encoding="utf-8"))
        for citation in CITATION.finditer(text):
            for number in NUMBER.finditer(citation[1]):
                if (int(number[1]), int(number[2])) not in known:
                    yield f"{name.as_posix()}: theory {number[0]} does not exist"


def wrong_paths(root, path, text):
    """Paths that a page names and the tree does not have; files that a page of equations must name and does not."""
    named = PATH.findall(text)
    exists = {name: (Path(root) / name).exists() for name in named}
    for name in sorted(set(named)):
        if not exists[name]:
            yield f"{path}: {name} does not exist"
    page = re.match(r"(\d+)", Path(path).name)
    if page and 1 <= int(page[1]) <= 11:
        if not any(exists[name] and name.startswith("tests/") and (Path(root) / name).is_file() for name in named):
            yield f"{path}: names no test that exists"
        if not any(exists[name] and SOURCE.fullmatch(name) for name in named):
            yield f"{path}: names no source file that exists"


def violations(root):
    """One line of text for each violation, and the number of equations."""
    known, found, pages = set(), [], pages_of(root)
    for path, text in pages:
        tags, wrong = tags_of(path, text)
        known.update(tags)
        found += wrong
    for path, text in pages:
        found += [f"{path}: {number[0]} does not exist" for number in NUMBER.finditer(TAG.sub("", text))
                  if (int(number[1]), int(number[2])) not in known]
        found += wrong_paths(root, path, text)
    found += wrong_citations(root, known)
    return found, len(known)


GOOD_TREE = {
    "docs/theory/00_notation.md": "Signs.\n\n$$\na = b\n\\tag{0.1}\n$$\n",
    "docs/theory/05_constraints.md":
        "# Constraints\n\n$$\na = b\n\\tag{5.1}\n$$\n\n$$\nc = d\n\\tag{5.3}\n$$\n\nSee (0.1). "
        "Where: `coupler/spring.cpp` | (5.1) | `tests/unit/spring.cpp`, a run of `cases/cut`\n",
    "docs/theory/12_built_in_numbers.md": "`coupler/spring.cpp`: 0.5\n",
    "coupler/spring.cpp": "/// The force. Theory (5.1), (5.3).\n/// A line that ends with theory\n/// (0.1) goes on.\n",
    "tests/unit/spring.cpp": "// as in theory (5.3)\n",
    "cases/cut/case.prm": "",
    "docs/index.md": "`coupler/not_a_theory_page.cpp`\n",
}
SPRING, PAGE = "coupler/spring.cpp", "docs/theory/05_constraints.md"
PLANTED = [
    ("citation of no equation", {SPRING: "// theory (5.2)\n"}),
    ("second citation in a row", {SPRING: "// THEORY (5.1), (6.1)\n"}),
    ("citation over two lines", {SPRING: "// see theory\n// (5.9)\n"}),
    ("citation in a test", {"tests/unit/spring.cpp": "// theory (5.1) and (7.1)\n"}),
    ("doubled tag", {PAGE: GOOD_TREE[PAGE].replace("5.3", "5.1"), SPRING: "", "tests/unit/spring.cpp": ""}),
    ("tag that does not ascend", {PAGE: GOOD_TREE[PAGE] + "\n$$\ne = f\n\\tag{5.2}\n$$\n"}),
    ("tag of another page", {PAGE: GOOD_TREE[PAGE] + "\n$$\ne = f\n\\tag{6.4}\n$$\n"}),
    ("tag in a line", {PAGE: GOOD_TREE[PAGE] + "\n$e = f \\tag{5.4}$\n"}),
    ("page that cites no equation", {PAGE: GOOD_TREE[PAGE] + "\nSee (4.2).\n"}),
    ("path that does not exist", {PAGE: GOOD_TREE[PAGE] + "\n`dem_side/bond/no_law.h`\n"}),
    ("folder that does not exist", {"docs/theory/12_built_in_numbers.md": "`cases/no_case`\n"}),
    ("page without test", {PAGE: GOOD_TREE[PAGE].replace("`tests/unit/spring.cpp`", "a test")}),
    ("page without source", {PAGE: GOOD_TREE[PAGE].replace("`coupler/spring.cpp`", "a file")}),
]


def self_test():
    """Each planted change must give exactly one violation, the tree without it none."""
    failures = 0
    for name, files in [("clean tree", {})] + PLANTED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, {**GOOD_TREE, **files})
            found, count = violations(root)
        good = count >= 2 and len(found) == (1 if files else 0)
        failures += not good
        print("ok  " if good else "FAIL", name, "->", found)
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(run_check(__doc__, violations, self_test, "equations"))
