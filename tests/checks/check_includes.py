#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The include rule: neither side knows the other or the coupler, and no library shows in a public header.

  check_includes.py ROOT [--deal-ii-in-coupler FILE ...]   exit code 1 and one line for each violation
  check_includes.py --self-test                            plants one violation of each kind and must find it
"""
import argparse
import re
import sys
import tempfile
from pathlib import Path

from source_tree import plant, project_files

PUBLIC_HEADERS = {
    "fem_side": {"fem_side/fem_side.h"},
    "dem_side": {"dem_side/dem_side.h", "dem_side/packing/packing.h", "dem_side/geometry/closed_surface.h", "dem_side/bond_network/bond_network.h", "dem_side/bond_network/network_operator.h", "dem_side/packing/stored_bonds.h",
                 "dem_side/packing/hdf5_file.h", "dem_side/script/stand_alone.h"},
}
# What each directory must not include, by the first part of the path.
FORBIDDEN = {
    "fem_side": {"dem_side", "coupler", "tests", "liggghts"},
    "dem_side": {"fem_side", "coupler", "tests", "deal.II"},
    "coupler": {"tests", "liggghts"},
}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


def includes(path):
    """(line number, is it in quotes, name) of each include of a file."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
        match = INCLUDE.match(line)
        if match:
            yield number, match[1] == '"', match[2]


def fits_public_header(header, name):
    """True for the standard library, Eigen, MPI, public headers of the same side, and HDF5 for the header that is named so."""
    standard = "/" not in name and "." not in name
    same_side = name in PUBLIC_HEADERS[header.split("/")[0]]
    return standard or same_side or name.startswith("Eigen/") or name == "mpi.h" or \
        (name == "hdf5.h" and header == "dem_side/packing/hdf5_file.h")


def objection(root, file, quoted, name, deal_ii_in_coupler):
    """Why this include is wrong, or None. file is relative to root, with slashes."""
    directory, target = file.split("/")[0], name.split("/")[0]
    if target in FORBIDDEN[directory]:
        return f"{directory} must not include {target} headers"
    # LIGGGHTS' own headers are found without their directory, so a name in quotes has to be a file of kerf.
    if quoted and directory != "dem_side" and not (root / name).is_file():
        return "includes in quotes are paths from the top of the repository"
    if directory == "coupler":
        if target in PUBLIC_HEADERS and name not in PUBLIC_HEADERS[target]:
            return f"the coupler uses only the public headers of {target}"
        if target == "deal.II" and file.split("/")[-1] not in deal_ii_in_coupler:
            return "deal.II is not meant to be used in this file of the coupler"
    elif file in PUBLIC_HEADERS[directory] and not fits_public_header(file, name):
        return "public headers include only the standard library, Eigen, MPI and public headers of their side"
    return None


def violations(root, deal_ii_in_coupler=()):
    """One line of text for each include that breaks the rule, and the number of files that were read."""
    found, count = [], 0
    for path in project_files(root):
        file = path.as_posix()
        if path.parts[0] not in FORBIDDEN or path.suffix not in (".h", ".hpp", ".cpp", ".cc"):
            continue
        count += 1
        for number, quoted, name in includes(Path(root) / path):
            reason = objection(Path(root), file, quoted, name, deal_ii_in_coupler)
            if reason:
                found.append(f"{file}:{number}: {name}: {reason}")
    return found, count


GOOD_TREE = {
    "fem_side/fem_side.h": '#include <Eigen/Core>\n#include <mpi.h>\n#include <vector>\n',
    "fem_side/solver.cpp": '#include "fem_side/fem_side.h"\n#include <deal.II/grid/tria.h>\n',
    "dem_side/packing/packing.h": '#include <Eigen/Core>\n',
    "dem_side/dem_side.h": '#include "dem_side/packing/packing.h"\n',
    "dem_side/packing/hdf5_file.h": '#include <hdf5.h>\n',
    "dem_side/engine.h": '#include "lammps.h"\n',
    "coupler/loop.cpp": '#include "dem_side/dem_side.h"\n#include "fem_side/fem_side.h"\n#include <cmath>\n',
    "coupler/application/case_file/case_file.cpp": '#include <deal.II/base/parameter_handler.h>\n',
    "tests/unit/test_loop.cpp": '#include "dem_side/engine.h"\n#include "fem_side/fem_side.h"\n',
}
PLANTED = [
    ("fem_side/solver.cpp", '#include "dem_side/packing/packing.h"'),
    ("fem_side/solver.cpp", '#include "coupler/loop.h"'),
    ("fem_side/solver.cpp", '#include <liggghts/lammps.h>'),
    ("fem_side/solver.cpp", '#include "lammps.h"'),
    ("dem_side/engine.h", '#include <deal.II/base/point.h>'),
    ("dem_side/engine.h", '#  include "fem_side/fem_side.h"'),
    ("dem_side/engine.h", '#include "coupler/loop.h"'),
    ("fem_side/fem_side.h", '#include <deal.II/base/point.h>'),
    ("fem_side/fem_side.h", '#include "fem_side/inner.h"'),
    ("dem_side/dem_side.h", '#include <hdf5.h>'),
    ("dem_side/packing/packing.h", '#include "lammps.h"'),
    ("coupler/loop.cpp", '#include <deal.II/base/point.h>'),
    ("coupler/loop.cpp", '#include <liggghts/lammps.h>'),
    ("coupler/loop.cpp", '#include "dem_side/engine.h"'),
]


def self_test():
    """Each planted line must give exactly one violation, the tree without it none."""
    failures = 0
    for file, line in [(None, None)] + PLANTED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, GOOD_TREE)
            plant(root, {"fem_side/inner.h": "", "coupler/loop.h": ""})
            if file:
                plant(root, {file: GOOD_TREE[file] + line + "\n"})
            found, _ = violations(root, ["case_file.cpp"])
        good = len(found) == 1 and found[0].startswith(f"{file}:") if file else not found
        failures += not good
        print("ok  " if good else "FAIL", file or "clean tree", line or "", "->", found)
    return 1 if failures else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("root", nargs="?")
    parser.add_argument("--deal-ii-in-coupler", nargs="*", default=[], metavar="FILE")
    parser.add_argument("--self-test", action="store_true")
    options = parser.parse_args()
    if options.self_test:
        return self_test()
    if options.root is None:
        parser.error("ROOT is missing")
    found, count = violations(options.root, options.deal_ii_in_coupler)
    print("\n".join(found) if found else f"include rule holds in {count} files")
    # An empty tree would pass without having been checked.
    return 1 if found or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
