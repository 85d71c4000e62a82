# SPDX-License-Identifier: GPL-2.0-or-later
"""Which files belong to the project, for the checks of the source tree."""
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


def plant(root, files):
    """Writes a tree for a self-test: files is {name: text}."""
    for name, text in files.items():
        path = Path(root) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
