#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The order of the rooms: who may include whom, and which files use a library.

  check_includes.py ROOT         exit code 1 and one line for each violation
  check_includes.py --self-test  plants one violation of each rule and must find it

Rules
  1. A room includes itself and the rooms that ROOMS lists for it. So the sides know neither each other nor the coupler, and the
     method does not know the application.
  2. Outside a side, only its public headers are included. They include only the standard library, Eigen, MPI and each other.
  3. A library's headers are included only in the files that LIBRARIES lists.
  4. Modules, a header together with its source, form no cycle.
  5. An include in quotes is a path from the top of the repository.
"""
import re
import sys
import tempfile
from pathlib import Path

from source_tree import plant, project_files, run_check

BOTH_SIDES = ["fem_side", "dem_side"]
BELOW_ENGINE = ["dem_side/bond", "dem_side/packing", "dem_side/geometry"]
METHOD = "coupler/method/"
APPLICATION = "coupler/application/"
BELOW_METHOD = ["coupler/loading", "coupler/energy", "coupler/base", *BOTH_SIDES]
BELOW_APPLICATION = ["coupler/method", *BELOW_METHOD]
# A room is a folder with all that is in it, or a module. The longest name that fits a file is its room.
ROOMS = {
    "fem_side/fem_side": [],
    "fem_side/element": ["fem_side/fem_side"],
    "fem_side/mesh": ["fem_side/element", "fem_side/fem_side"],
    "fem_side/boundary": ["fem_side/mesh", "fem_side/element", "fem_side/fem_side"],
    "fem_side/solver": ["fem_side/boundary", "fem_side/mesh", "fem_side/element", "fem_side/fem_side"],

    "dem_side/geometry": [],
    "dem_side/packing": ["dem_side/geometry"],
    "dem_side/bond": ["dem_side/packing", "dem_side/geometry"],
    "dem_side/errors": [],
    "dem_side/particle_types": ["dem_side/bond", "dem_side/packing", "dem_side/geometry"],
    "dem_side/dem_settings": ["dem_side/bond", "dem_side/packing", "dem_side/geometry"],
    "dem_side/bond_network": ["dem_side/bond", "dem_side/packing", "dem_side/geometry"],
    "dem_side/engine": ["dem_side/dem_settings", "dem_side/particle_types", "dem_side/errors", *BELOW_ENGINE],
    "dem_side/generation": ["dem_side/engine", "dem_side/bond_network", "dem_side/bond", "dem_side/packing", "dem_side/geometry"],
    "dem_side/script": ["dem_side/engine", "dem_side/bond_network", "dem_side/dem_settings", "dem_side/particle_types", "dem_side/errors", *BELOW_ENGINE],
    "dem_side/dem_side": ["dem_side"],

    "coupler/base": BOTH_SIDES,
    "coupler/energy": ["coupler/base", *BOTH_SIDES],
    "coupler/loading": ["coupler/energy", "coupler/base", *BOTH_SIDES],
    METHOD + "overlap": ["coupler/base", *BOTH_SIDES],
    METHOD + "constraint/exchange": [METHOD + "overlap", "coupler/energy", "coupler/base", *BOTH_SIDES],
    METHOD + "constraint": [METHOD + "overlap", "coupler/energy", "coupler/base", *BOTH_SIDES],
    METHOD + "activation": [METHOD + "overlap", "coupler/base", *BOTH_SIDES],
    METHOD + "model_settings": [METHOD + "overlap", METHOD + "constraint", METHOD + "activation", *BELOW_METHOD],
    METHOD + "step_timer": [],
    METHOD + "stability": [METHOD + "model_settings", METHOD + "constraint", METHOD + "overlap", *BELOW_METHOD],
    METHOD + "conversion_audit": [METHOD + "activation", *BELOW_METHOD],
    METHOD + "conversion": [METHOD + "conversion_audit", METHOD + "stability", METHOD + "constraint", METHOD + "activation",
                            METHOD + "overlap", METHOD + "model_settings", *BELOW_METHOD],
    METHOD + "surface_shares": [METHOD + "overlap", *BELOW_METHOD],
    METHOD + "coupled_model": ["coupler/method", *BELOW_METHOD],
    APPLICATION + "case_file": BELOW_APPLICATION,
    APPLICATION + "run_options": [APPLICATION + "case_file", *BELOW_APPLICATION],
    APPLICATION + "output": BELOW_APPLICATION,
    APPLICATION + "setup": [APPLICATION + "case_file", APPLICATION + "output", *BELOW_APPLICATION],
    **{APPLICATION + room: [APPLICATION + "setup", APPLICATION + "case_file", APPLICATION + "output", APPLICATION + "run_options",
                            *BELOW_APPLICATION] for room in ("commands", "calibration", "stand_alone")},
    "coupler/command_line": ["coupler/application", "coupler/base"],
    "coupler/main": ["coupler/command_line", "coupler/application", "coupler/base"],
}
PUBLIC_HEADERS = {
    "fem_side": {"fem_side/fem_side.h"},
    "dem_side": {"dem_side/" + name + ".h" for name in (
        "dem_side", "particle_types", "dem_settings", "errors", "bond/bond_kinematics", "bond/bond_parameters", "bond_network/bond_network",
        "bond_network/moduli", "bond_network/network_operator", "geometry/closed_surface", "geometry/grid", "packing/hdf5_file",
        "packing/packing", "packing/stored_bonds", "script/script_force", "script/stand_alone")},
}
# Headers of a library by their first folder or, for those found without one, by a list; and who may include them.
LIBRARIES = {
    "deal.II": {"fem_side/mesh/", "fem_side/solver/", "coupler/application/case_file/", "coupler/application/output/field_output."},
    "liggghts": {"dem_side/engine/", "dem_side/script/", "dem_side/generation/compaction.", "dem_side/dem_side.cpp"},
}
EXTRA_IN_PUBLIC = {"dem_side/packing/hdf5_file.h": {"hdf5.h"}}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCES = (".h", ".hpp", ".cpp", ".cc")


def room_of(file):
    """The longest room that the file belongs to, or None."""
    stem = file.rsplit(".", 1)[0]
    fitting = [room for room in ROOMS if stem == room or file.startswith(room + "/")]
    return max(fitting, key=len, default=None)


def covers(listed, file):
    """A listed room stands for all that is in it, for the module of that name, or for a whole side."""
    return file.rsplit(".", 1)[0] == listed or file.startswith(listed + "/")


class Tree:
    """Includes of all sources of kerf, without those of the tests."""

    def __init__(self, root):
        self.root = Path(root)
        self.includes = {}
        for path in project_files(root):
            if path.parts[0] in ("coupler", "dem_side", "fem_side") and path.suffix in SOURCES:
                lines = (self.root / path).read_text(encoding="utf-8").splitlines()
                found = ((number, INCLUDE.match(line)) for number, line in enumerate(lines, 1))
                self.includes[path.as_posix()] = [(number, match[1] == '"', match[2]) for number, match in found if match]

    def library_of(self, file, quoted, name):
        """Which library a header belongs to, or None. LIGGGHTS' own are found without their folder."""
        top = name.split("/")[0]
        if top in LIBRARIES:
            return top
        return "liggghts" if quoted and file.startswith("dem_side/") and "/" not in name and "style_" not in name else None

    def objection(self, file, quoted, name):
        """Why this include is wrong, or None."""
        library = self.library_of(file, quoted, name)
        if library:
            allowed = any(file.startswith(place) for place in LIBRARIES[library])
            return None if allowed else f"{library} is not meant to be used in this file"
        if name.split("/")[0] == "tests":
            return "tests are not part of the program"
        if name.split("/")[0] not in ("coupler", "dem_side", "fem_side"):
            if quoted and "style_" not in name:
                return "includes in quotes are paths from the top of the repository"
            return self.public_objection(file, name)
        if not (self.root / name).is_file():
            return "includes in quotes are paths from the top of the repository"
        room, side = room_of(file), name.split("/")[0]
        if room is None:
            return "this file is in no room"
        if not (covers(room, name) or any(covers(listed, name) for listed in ROOMS[room])):
            return f"{room} must not include this"
        if side in PUBLIC_HEADERS and not file.startswith(side + "/") and name not in PUBLIC_HEADERS[side]:
            return f"the coupler uses only the public headers of {side}"
        return self.public_objection(file, name)

    @staticmethod
    def public_objection(file, name):
        """Public headers of a side show no library and nothing private."""
        for headers in PUBLIC_HEADERS.values():
            if file in headers:
                standard = "/" not in name and "." not in name
                if not (standard or name in headers or name.startswith("Eigen/") or name == "mpi.h" or
                        name in EXTRA_IN_PUBLIC.get(file, ())):
                    return "public headers include only the standard library, Eigen, MPI and public headers of their side"
        return None

    def violations(self):
        """One line of text for each include that breaks a rule, and for each cycle."""
        for file, includes in self.includes.items():
            for number, quoted, name in includes:
                reason = self.objection(file, quoted, name)
                if reason:
                    yield f"{file}:{number}: {name}: {reason}"
        yield from self.cycles()

    def cycles(self):
        """One line for each group of modules that include each other."""
        def module(file):
            return file.rsplit(".", 1)[0]
        graph = {}
        for file, includes in self.includes.items():
            targets = graph.setdefault(module(file), set())
            targets.update(module(name) for _, _, name in includes if name in self.includes and module(name) != module(file))
        reach = {}
        for start in graph:
            seen, stack = set(), list(graph[start])
            while stack:
                node = stack.pop()
                if node not in seen:
                    seen.add(node)
                    stack.extend(graph[node])
            reach[start] = seen
        reported = set()
        for start in sorted(graph):
            group = tuple(sorted(node for node in reach[start] if start in reach[node]))
            if start in reach[start] and group not in reported:
                reported.add(group)
                yield "cycle of modules: " + ", ".join(group)


GOOD_TREE = {
    "fem_side/fem_side.h": '#include <Eigen/Core>\n#include <mpi.h>\n#include <vector>\n',
    "fem_side/element/law.h": '#include "fem_side/fem_side.h"\n',
    "fem_side/mesh/mesh.cpp": '#include "fem_side/element/law.h"\n#include <deal.II/grid/tria.h>\n',
    "fem_side/boundary/load.cpp": '#include "fem_side/fem_side.h"\n',
    "fem_side/solver/solver.cpp": '#include "fem_side/fem_side.h"\n',
    "dem_side/geometry/bins.h": '#include <vector>\n',
    "dem_side/packing/laguerre.h": '#include "dem_side/geometry/bins.h"\n',
    "dem_side/bond/law.h": '#include <cmath>\n',
    "dem_side/bond_network/network.cpp": '#include "dem_side/bond/law.h"\n',
    "dem_side/engine/loop.h": '#include "lammps.h"\n',
    "dem_side/generation/compaction.cpp": '#include "input.h"\n',
    "dem_side/script/line.cpp": '#include "dem_side/engine/loop.h"\n',
    "dem_side/dem_side.h": '#include <Eigen/Core>\n',
    "coupler/base/errors.h": '#include <stdexcept>\n',
    "coupler/energy/ledger.h": '#include "coupler/base/errors.h"\n',
    "coupler/loading/tool.h": '#include "coupler/energy/ledger.h"\n#include "fem_side/fem_side.h"\n',
    "coupler/method/overlap/overlap.h": '#include "fem_side/fem_side.h"\n',
    "coupler/method/constraint/exchange/batches.h": '#include "coupler/method/overlap/overlap.h"\n',
    "coupler/method/constraint/constraint.h": '#include "coupler/method/constraint/exchange/batches.h"\n',
    "coupler/method/activation/rule.h": '#include "coupler/method/overlap/overlap.h"\n',
    "coupler/method/stability/step.h": '#include "coupler/method/constraint/constraint.h"\n',
    "coupler/method/conversion.h": '#include "coupler/method/stability/step.h"\n#include "coupler/method/activation/rule.h"\n',
    "coupler/method/coupled_model.h": '#include "coupler/method/conversion.h"\n#include "coupler/loading/tool.h"\n',
    "coupler/application/case_file/case.cpp": '#include <deal.II/base/parameter_handler.h>\n',
    "coupler/application/case_file/case.h": '',
    "coupler/application/output/history.h": '#include "coupler/method/coupled_model.h"\n',
    "coupler/application/setup/problem.h": '#include "coupler/application/case_file/case.h"\n',
    "coupler/application/commands/run.h": '#include "coupler/application/setup/problem.h"\n',
    "coupler/application/calibration/search.h": '',
    "coupler/main.cpp": '#include "coupler/application/commands/run.h"\n#include <CLI/CLI.hpp>\n',
    "tests/unit/test_loop.cpp": '#include "dem_side/engine/loop.h"\n',
}
PLANTED = [
    ("fem_side/element/law.h", '#include "fem_side/mesh/mesh.h"'),
    ("fem_side/mesh/mesh.cpp", '#include "fem_side/boundary/load.h"'),
    ("fem_side/boundary/load.cpp", '#include "fem_side/solver/solver.h"'),
    ("fem_side/solver/solver.cpp", '#include "dem_side/dem_side.h"'),
    ("fem_side/solver/solver.cpp", '#include "coupler/base/errors.h"'),
    ("fem_side/element/law.h", '#include <deal.II/base/point.h>'),
    ("fem_side/fem_side.h", '#include <hdf5.h>'),
    ("fem_side/fem_side.h", '#include <deal.II/base/point.h>'),
    ("fem_side/solver/solver.cpp", '#include <liggghts/lammps.h>'),
    ("dem_side/geometry/bins.h", '#include "dem_side/bond/law.h"'),
    ("dem_side/packing/laguerre.h", '#include "dem_side/bond/law.h"'),
    ("dem_side/bond/law.h", '#include "dem_side/engine/loop.h"'),
    ("dem_side/bond/law.h", '#include "lammps.h"'),
    ("dem_side/bond_network/network.cpp", '#include "dem_side/engine/loop.h"'),
    ("dem_side/engine/loop.h", '#include "dem_side/dem_side.h"'),
    ("dem_side/engine/loop.h", '#  include "fem_side/fem_side.h"'),
    ("dem_side/engine/loop.h", '#include <deal.II/base/point.h>'),
    ("dem_side/script/line.cpp", '#include "coupler/base/errors.h"'),
    ("dem_side/dem_side.h", '#include "lammps.h"'),
    ("coupler/base/errors.h", '#include "coupler/energy/ledger.h"'),
    ("coupler/energy/ledger.h", '#include "coupler/loading/tool.h"'),
    ("coupler/loading/tool.h", '#include "coupler/method/overlap/overlap.h"'),
    ("coupler/loading/tool.h", '#include "coupler/application/case_file/case.h"'),
    ("coupler/method/overlap/overlap.h", '#include "coupler/method/activation/rule.h"'),
    ("coupler/method/activation/rule.h", '#include "coupler/method/constraint/constraint.h"'),
    ("coupler/method/constraint/constraint.h", '#include "coupler/method/activation/rule.h"'),
    ("coupler/method/constraint/exchange/batches.h", '#include "coupler/method/constraint/constraint.h"'),
    ("coupler/method/stability/step.h", '#include "coupler/method/conversion.h"'),
    ("coupler/method/conversion.h", '#include "coupler/method/coupled_model.h"'),
    ("coupler/method/coupled_model.h", '#include "coupler/application/case_file/case.h"'),
    ("coupler/method/coupled_model.h", '#include <deal.II/base/point.h>'),
    ("coupler/method/coupled_model.h", '#include "dem_side/engine/loop.h"'),
    ("coupler/method/coupled_model.h", '#include <liggghts/lammps.h>'),
    ("coupler/application/case_file/case.h", '#include "coupler/application/setup/problem.h"'),
    ("coupler/application/output/history.h", '#include "coupler/application/case_file/case.h"'),
    ("coupler/application/setup/problem.h", '#include "coupler/application/commands/run.h"'),
    ("coupler/application/commands/run.h", '#include "coupler/application/calibration/search.h"'),
    ("coupler/application/commands/run.h", '#include "coupler/main.h"'),
    ("coupler/application/commands/run.h", '#include "tests/unit/test_loop.h"'),
    ("coupler/application/commands/run.h", '#include "problem.h"'),
]
CYCLE = {"coupler/base/errors.h": '#include "coupler/base/mpi.h"\n', "coupler/base/mpi.h": "",
         "coupler/base/mpi.cpp": '#include "coupler/base/errors.h"\n'}


def self_test():
    """The tree without a planted line has no violation, with it one that names the file; a cycle is found, too."""
    failures = 0
    for file, line in [(None, None)] + PLANTED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, {"fem_side/mesh/mesh.h": "", "fem_side/boundary/load.h": "", "fem_side/solver/solver.h": ""})
            plant(root, GOOD_TREE)
            if file:
                plant(root, {file: GOOD_TREE[file] + line + "\n"})
            found = [text for text in Tree(root).violations() if not text.startswith("cycle")]
        good = len(found) == 1 and found[0].startswith(f"{file}:") if file else not found
        failures += not good
        print("ok  " if good else "FAIL", file or "clean tree", line or "", "->", found)
    with tempfile.TemporaryDirectory() as root:
        plant(root, {**GOOD_TREE, **CYCLE})
        found = list(Tree(root).violations())
    good = found == ["cycle of modules: coupler/base/errors, coupler/base/mpi"]
    print("ok  " if good else "FAIL", "cycle ->", found)
    return 1 if failures or not good else 0


def violations(root):
    """Lines of text, and the number of files that were read."""
    tree = Tree(root)
    return list(tree.violations()), len(tree.includes)


if __name__ == "__main__":
    sys.exit(run_check(__doc__, violations, self_test, "files"))
