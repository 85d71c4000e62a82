# SPDX-License-Identifier: GPL-2.0-or-later
"""Which files belong to the project, for the checks of the source tree."""
import argparse
import subprocess
from pathlib import Path


def project_files(root):
    """Paths, relative to root, of the files that are tracked or about to be; the whole tree without git (a source archive)."""
    # safe.directory: the tree may belong to another user than the one who tests, as in a container.
    command = ["git", "-c", "safe.directory=*", "-C", str(root), "ls-files", "-z",
               "--cached", "--others", "--exclude-standard"]
    if (Path(root) / ".git").exists():
        listing = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split("\0")
        names = [Path(name) for name in listing if name]
    else:
        names = [path.relative_to(root) for path in Path(root).rglob("*")]
        names = [name for name in names if not name.parts[0].startswith(("build", "results"))]
    return sorted(name for name in names if (Path(root) / name).is_file() and "__pycache__" not in name.parts)


def run_check(documentation, violations, self_test, noun):
    """The command line of a check: ROOT or --self-test; the exit code. violations(root) gives lines of text and a count of nouns."""
    parser = argparse.ArgumentParser(description=documentation, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    if options.root is None:
        parser.error("ROOT is missing")
    found, count = violations(options.root)
    print("\n".join(found) if found else f"{count} {noun}, nothing found")
    # An empty tree would pass without having been checked.
    return 1 if found or count == 0 else 0


def plant(root, files):
    """Writes a tree for a self-test: files is {name: text}."""
    for name, text in files.items():
        path = Path(root) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
