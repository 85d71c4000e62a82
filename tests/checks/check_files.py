#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Checks of all files of the project.

  check_files.py ROOT --licence    every source file names the licence in its first line (second after #!)
  check_files.py ROOT --size       no file is larger than 2 MB
  check_files.py --self-test       both on a tree with planted violations
"""
import argparse
import sys
import tempfile
from pathlib import Path

from source_tree import plant, project_files

SPDX = "SPDX-License-Identifier: GPL-2.0-or-later"
SOURCE_SUFFIXES = {".h", ".hpp", ".cpp", ".cc", ".py", ".sh", ".cmake"}
SOURCE_NAMES = {"CMakeLists.txt", "run", "test"}
LARGEST = 2_000_000  # bytes


def without_licence(root):
    """Source files without the licence line."""
    for name in project_files(root):
        if name.suffix in SOURCE_SUFFIXES or name.name in SOURCE_NAMES:
            lines = (Path(root) / name).read_text(encoding="utf-8").splitlines()
            first = lines[1:2] if lines and lines[0].startswith("#!") else lines[:1]
            if not (first and first[0].lstrip("/# ") == SPDX):
                yield f"{name}: the first line is not '{SPDX}'"


def too_large(root):
    """Files above the limit."""
    for name in project_files(root):
        size = (Path(root) / name).stat().st_size
        if size > LARGEST:
            yield f"{name}: {size / 1e6:.1f} MB, the limit is {LARGEST / 1e6:.0f} MB"


def self_test():
    with tempfile.TemporaryDirectory() as root:
        plant(root, {"run": f"#!/bin/bash\n# {SPDX}\n", "a/good.h": f"// {SPDX}\n", "a/data.txt": "x" * LARGEST})
        clean = list(without_licence(root)) + list(too_large(root))
        plant(root, {"test": "#!/bin/bash\n", "a/bad.cpp": "int main() {}\n", "a/late.py": f"import sys\n# {SPDX}\n",
                     "a/empty.h": "", "a/data.txt": "x" * (LARGEST + 1)})
        licence, size = list(without_licence(root)), list(too_large(root))
    print(clean, licence, size, sep="\n")
    names = [line.split(":")[0] for line in licence]
    good = not clean and names == ["a/bad.cpp", "a/empty.h", "a/late.py", "test"] and len(size) == 1
    return 0 if good else 1


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?")
    parser.add_argument("--licence", action="store_true")
    parser.add_argument("--size", action="store_true")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    if options.root is None or not (options.licence or options.size):
        parser.error("ROOT and --licence or --size are needed")
    found = list(without_licence(options.root)) if options.licence else []
    found += too_large(options.root) if options.size else []
    print("\n".join(found) if found else f"{len(project_files(options.root))} files, nothing found")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
