#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Every bad input gives one clear line, exit code 2, and leaves everything that was there as it was.

usage: bad_inputs.py KERF SMALL_CASE
"""
import os
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
passed = failed = 0


def listing(directory):
    return sorted((os.path.join(root, name), os.lstat(os.path.join(root, name)).st_mtime_ns)
                  for root, _, names in os.walk(directory) for name in names)


def expect(name, arguments, *words, code=2, ranks=1, cwd=None):
    """One line on stderr that holds all words, the exit code, and no file changed or added in the working directory."""
    global passed, failed
    before = listing(cwd)
    result = kerf_runner.run(KERF, arguments, ranks=ranks, cwd=cwd)
    lines = [line for line in result.stderr.splitlines() if line.strip()]
    if ranks > 1:  # mpirun adds its own lines about an exit code
        lines = [line for line in lines if line.startswith("kerf:")]
    problems = []
    if result.returncode != code:
        problems.append(f"exit code {result.returncode} instead of {code}")
    if len(lines) != 1 or not lines[0].startswith("kerf: "):
        problems.append("not one line: " + repr(result.stderr))
    for word in words:
        if word not in result.stderr:
            problems.append(f"'{word}' is not in: {result.stderr!r}")
    if listing(cwd) != before:
        problems.append("files were changed")
    passed, failed = passed + (not problems), failed + bool(problems)
    print(("ok      " if not problems else "FAILED  ") + name + ": " + (lines[0] if lines else ""))
    for problem in problems:
        print("        " + problem)


with tempfile.TemporaryDirectory() as work:
    good = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "good"))
    made = kerf_runner.run(KERF, ["pack", good], cwd=work)
    assert made.returncode == 0, made.stderr

    def bad(name, edit, *words, more=(), **options):
        case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, name), edit)
        for store in os.listdir(good):
            if store.endswith(".h5"):
                os.link(os.path.join(good, store), os.path.join(case, store))
        expect(name, ["run", case, *more], case, *words, cwd=work, **options)

    def change(old, new):
        return lambda text: text.replace(old, new)

    bad("unknown_key", change("set Sigma star", "set Sigma stat"), "Adaptivity/Sigma stat", "Adaptivity/Sigma star")
    bad("unknown_key_on_two_ranks", change("set Sigma star", "set Sigma stat"), "the nearest valid key is", ranks=2)
    bad("unknown_section", change("subsection Rock", "subsection Rocks"), "Rocks/Density", "Rock/Density")
    bad("empty_unknown_section", lambda text: text + "\nsubsection Couplinbing\nend\n", "unknown section Couplinbing", "Coupling/")
    bad("nested_section", lambda text: text + "\nsubsection Mesh\nsubsection Mesh\nend\nend\n", "stands in another one")
    bad("out_of_range", change("ratio        = 0.2", "ratio        = 0.7"), "Rock/Poisson ratio", "0.7", "[0, 0.499]")
    bad("not_a_number", change("Density              = 2400", "Density = heavy"), "Rock/Density", "heavy", "> 0")
    bad("broken_line", change("set Overlap width = 8", "Overlap width 8"), "not understood", "case.prm:")
    bad("no_end", lambda text: text.rstrip()[:-3], "has no 'end'")
    bad("missing_mesh", change("set Cell size", "set File = rock.msh\n  set Cell size"), "rock.msh", "does not exist")
    bad("step_too_large", change("set End time = 4e-4", "set End time = 4e-4\n  set Time step = 1e-5"), "Time/Time step",
        "stable step")
    bad("sigma_star_negative", change("Sigma star = 3e6", "Sigma star = -1"), "Adaptivity/Sigma star", ">= 0")
    bad("sigma_star_fraction", change("Sigma star = 3e6", "Sigma star fraction = 1.5"), "Adaptivity/Sigma star fraction", "[0.01, 1]")
    bad("platens_at_rest", change("set Radius         =", "set Kind = platens\n  set Closing speed = 0\n  set Radius ="), "Tool/Closing speed", "not be 0")
    bad("not_calibrated", None, "Bond/Strength", "strengths.txt", "kerf calibrate", more=["--set", "Bond/Strength=calibrated"])
    bad("overlap_too_wide", change("Overlap width = 8", "Overlap width = 40"), "Coupling/Overlap width", "wider than the mesh")
    bad("empty_packing", change("Mean diameter = 1e-3", "Mean diameter = 0.1"), "Packing", "mean diameters", more=["--mode", "dem"])
    bad("tool_inside_rock", change("0 0.024 0.04402", "0 0.024 0.040"), "Tool/Path", "inside the rock")
    bad("disc_ends_in_2d", change("set Path", "set Width = 0.005\n  set Path"), "Tool/Width", "three dimensions")
    bad("bad_path", change("0 0.024 0.04402", "0 0.024"), "Tool/Path", "3 numbers")
    bad("bad_boundary", change("subsection Packing", "subsection Boundary\n set Conditions = left: glued\nend\nsubsection Packing"),
        "Boundary/Conditions", "glued", "roller")
    bad("periodic_along_z_in_2d", change("set Cell size", "set Periodic = z\n  set Cell size"), "Mesh/Periodic", "none or y")
    bad("held_periodic_side", change("set Cell size", "set Periodic = y\n  set Cell size"), "no boundary id 2", "periodic sides")
    bad("store_is_not_periodic", lambda text: text.replace("set Cell size", "set Periodic = y\n  set Cell size").replace(
        "subsection Packing", "subsection Boundary\n set Conditions = left: fixed\nend\nsubsection Packing"),
        "is not periodic along y", "Mesh/Periodic", more=["--set", "Tool/Kind=none"])
    bad("plane_is_no_number", change("set Radius spread", "set Lattice plane = left\n  set Radius spread"), "Packing/Lattice plane", "'left'")

    def with_conditions(conditions):
        return change("subsection Packing", f"subsection Boundary\n set Conditions = {conditions}\nend\nsubsection Packing")

    bad("assignment", with_conditions("y = 1: fixed"), "'=' alone is an assignment", "Boundary/Conditions")
    bad("side_of_a_disc", change("set Cell size", "set Shape = disc\n  set Cell size"), "only a box has sides with names")
    bad("given_twice", change("set Cell size", "set Cell size = 2e-3\n  set Cell size"), "Mesh/Cell size is given twice")
    bad("stop_below_with_a_disc", change("set End time", "set Stop below = 0.5\n  set End time"), "Time/Stop below", "platens")
    bad("weaker_pressed_than_pulled", change("Compressive strength = 30e6", "Compressive strength = 3e6"), "Rock/Compressive strength",
        "below Rock/Tensile strength")
    bad("bad_place", with_conditions("y << 1: fixed"), "y << 1", "expression of x, y and z")
    bad("empty_place", with_conditions("y < -1: fixed"), "no boundary face", "y < -1")
    bad("bad_traction", with_conditions("top: traction 1e6"), "traction TX TY ramp DURATION")
    bad("bad_refinement", change("set Cell size", "set Refine = 0 0 0.01 0.01\n  set Cell size"), "Mesh/Refine", "5 numbers")
    bad("bad_refinement_level", change("set Cell size", "set Refine = 0 0 0.01 0.01 1.5\n  set Cell size"), "Mesh/Refine", "1 to 8")
    bad("bad_initial_stress", change("subsection Packing", "subsection Loads\n set Initial stress = -1e6\nend\nsubsection Packing"),
        "Loads/Initial stress", "3 numbers")
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "other_store"),
                                 change("set Mean diameter = 1e-3", "set Mean diameter = 1e-3\n  set Gap tolerance = 0.2"))
    for store in os.listdir(good):
        if store.endswith(".h5"):
            os.link(os.path.join(good, store), os.path.join(case, store))
    expect("store_of_another_rock", ["run", case], "gap tolerance", "remove the file", cwd=work)
    expect("missing_case", ["run", os.path.join(work, "nowhere")], "nowhere", "no such case directory", cwd=work)
    expect("bad_override", ["run", good, "--set", "Rock/Density"], "Section/Key=value", cwd=work)
    expect("override_out_of_range", ["run", good, "--set", "Time/Safety=2"], "Time/Safety", cwd=work)
    with open(os.path.join(good, "damaged.h5"), "w") as file:
        file.write("this is no store")
    expect("damaged_store", ["run", good, "--set", "Packing/File=damaged.h5"], "damaged.h5", cwd=work)

    for width, warned in (("4", True), ("8", False)): # allowed, but said
        narrow = kerf_runner.run(KERF, ["check", good, "--set", "Coupling/Overlap width=" + width], cwd=work)
        right = narrow.returncode == 0 and ("warning: Coupling/Overlap width is 1 cells" in narrow.stdout) == warned
        passed, failed = passed + right, failed + (not right)
        print(("ok      " if right else "FAILED  ") + f"overlap of {width} d, warning {warned}")

    # Numbers, names and paths at the ends of their ranges.
    def refused(name, arguments, *words):
        expect(name, arguments, *words, cwd=work)

    refused("boundary_number", ["check", good, "--set", "Boundary/Conditions=99999999999: fixed"], "Boundary/Conditions", "nine digits")
    refused("hexadecimal", ["check", good, "--set", "Tool/Path=0 0x10 1"], "Tool/Path", "3 numbers")
    refused("infinite", ["check", good, "--set", "Tool/Path=0 0.024 inf"], "Tool/Path", "3 numbers")
    refused("key_of_2000_letters", ["check", good, "--set", f"Rock/{'k' * 2000}=1"], "k" * 80 + "...,", "Rock/")
    refused("value_of_2000_letters", ["check", good, "--set", f"Rock/Density={'k' * 2000}"], "'" + "k" * 80 + "...'", "Rock/Density")
    refused("unprintable", ["check", good, "--set", "Rock/Density=\x1b[31m\n7\x07"], "'?[31m 7?'", "Rock/Density")
    refused("key_of_its_section", ["check", good, "--set", "Mesh/Tensile strength=1"], "the nearest valid key is Mesh/")
    for command in ("run", "export"):
        refused(f"long_name_{command}", [command, good, "--output", "k" * 300], "k" * 80 + "...: File name too long")
        refused(f"long_path_{command}", [command, good, "--output", "kk/" * 2000], "File name too long")
    os.symlink("loop", os.path.join(work, "loop"))
    refused("loop_of_links", ["run", good, "--output", os.path.join(work, "loop")], "symbolic links")
    refused("case_in_a_loop", ["check", os.path.join(work, "loop")], "symbolic links")
    refused("long_case", ["check", "k" * 300], "File name too long")
    refused("results_below_a_file", ["run", good, "--output", os.path.join(good, "case.prm", "r")], "Not a directory")
    refused("results_in_proc", ["run", good, "--output", "/proc/results"], "cannot be made")
    refused("store_in_no_directory", ["pack", good, "--set", "Packing/File=no/where.h5"], "where.h5", "No such file or directory")
    os.mkfifo(os.path.join(work, "pipe"))
    mesh = ["--set", "Boundary/Conditions=y < 1e-6: fixed", "--set"]
    for name, path in (("device", "/dev/zero"), ("pipe", os.path.join(work, "pipe")), ("directory", work)):
        refused("mesh_is_a_" + name, ["check", good, *mesh, "Mesh/File=" + path], "Mesh/File", path, "is no file")
        refused("store_is_a_" + name, ["check", good, "--set", "Packing/File=" + path], "Packing/File", path, "is no file")
        refused("surface_is_a_" + name, ["check", good, "--set", "Packing/Surface=" + path], "Packing/Surface", path, "is no file")
    os.makedirs(os.path.join(work, "piped"))
    os.mkfifo(os.path.join(work, "piped", "case.prm"))
    refused("case_is_a_pipe", ["check", os.path.join(work, "piped")], "case.prm is no file")
    for name, words in (("unknown_word", ["blah"]), ("no_case", ["run"]), ("unknown_option", ["check", good, "--ovewrite"]),
                        ("unknown_mode", ["run", good, "--mode", "x"]), ("mode_twice", ["run", good, "--mode", "fem", "--mode", "dem"])):
        refused(name, words, "command line: ", "kerf --help")
    for name, setting in (("time", "Loads/Gravity ramp=1e-310"), ("smoothing", "Tool/Smoothing time=4e-320"),
                          ("component", "Loads/Gravity=1e-310, 0")):
        result = kerf_runner.run(KERF, ["check", good, "--mode", "fem", "--set", setting], cwd=work)
        passed, failed = passed + (result.returncode == 0), failed + (result.returncode != 0)
        print(("ok      " if result.returncode == 0 else "FAILED  ") + f"denormal {name} is zero: {result.stderr.strip()}")

    # What does not fit into the machine is refused before it is made.
    for name, setting, words in (
            ("cells", "Mesh/Cell size=1e-9", ("Mesh/Cell size = 1e-09", "cells, kerf can number")),
            ("cell_of_no_size", "Mesh/Cell size=1e-300", ("Mesh/Cell size", "cells, kerf can number")),
            ("refined_cells", "Mesh/Refine=0 0 0.1 0.1 8; 0 0 0.1 0.1 8; 0 0 0.1 0.1 8; 0 0 0.1 0.1 8; 0 0 0.1 0.1 8", ("Mesh/Refine", "GB")),
            ("contact_points", "Packing/Mean diameter=1e-9", ("Packing/Mean diameter = 1e-09", "contact points", "--force")),
            ("particles", "Packing/Mean diameter=1e-6", ("Packing/Mean diameter = 1e-06", "particles", "--force")),
            ("steps", "Time/End time=1e300", ("Time/End time", "steps"))):
        memory = f"ulimit -v 8000000; exec {KERF} check {good} --set '{setting}' --set Packing/File=new.h5 --mode " + (
            "adaptive" if name == "particles" else "fem")
        result = subprocess.run(["bash", "-c", memory], cwd=work, capture_output=True, text=True, timeout=20)
        right = result.returncode == 2 and result.stderr.startswith("kerf: ") and len(result.stderr.splitlines()) == 1 and all(
            word in result.stderr for word in words)
        passed, failed = passed + right, failed + (not right)
        print(("ok      " if right else "FAILED  ") + f"too many {name}: {result.stderr.strip()}")

    # Conditions that contradict each other, and those that are probably not meant.
    for name, settings, words in (
            ("roller_and_velocity", ("Boundary/Conditions=left: roller; x < 1e-6: velocity 1 0",), ("Boundary/Conditions", "contradict")),
            ("fixed_and_traction", ("Boundary/Conditions=left: fixed; left: traction 0 1e5",), ("Boundary/Conditions", "contradict")),
            ("in_situ_without_stress", ("Boundary/Conditions=left: in_situ",), ("Boundary/Conditions", "Loads/Initial stress")),
            ("refined_outside", ("Mesh/Refine=1 1 2 2 1",), ("Mesh/Refine", "outside of the mesh")),
            ("overlap_below_a_particle", ("Coupling/Overlap width=0.5",), ("Coupling/Overlap width", "narrower than a particle"))):
        refused(name, ["check", good] + [word for setting in settings for word in ("--set", setting)], *words)
    for name, setting, words in (
            ("roller and traction", "Boundary/Conditions=left: roller; x < 1e-6: traction 0 1e5; bottom: fixed; y < 1e-6: fixed", ""),
            ("stress at free sides", "Loads/Initial stress=-1e6 -1e6 0", "Loads/Initial stress acts on free faces"),
            ("stress along free sides", "Loads/Initial stress=-1e6 0 0", ""),
            ("modulus in GPa", "Rock/Young modulus=18.7", "Rock/Young modulus = 18.7 Pa: the rock would fail at a strain of"),
            ("disc that stays away", "Tool/Path=0 0.024 0.05; 1 0.024 0.06", "Tool/Path: the disc stays at least 0.006"),
            ("disc that comes later", "Tool/Path=0 0.024 0.05; 1 0.024 0.03", "Tool/Path: the disc stays"),
            ("sigma* above the strength", "Adaptivity/Sigma star=1e9", "Adaptivity/Sigma star: sigma* = 1000 MPa"),
            ("held specimen", "Tool/Kind=platens", "Boundary/Conditions: roller")):
        result = kerf_runner.run(KERF, ["check", good, "--set", setting], cwd=work)
        said = [line for line in result.stdout.splitlines() if line.startswith("warning: ")]
        right = result.returncode == 0 and (len(said) == 1 and words in said[0] if words else not said)
        passed, failed = passed + right, failed + (not right)
        print(("ok      " if right else "FAILED  ") + f"{name}: {said}")

    # A check makes no store unless told.
    bare = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "bare"))
    first = kerf_runner.run(KERF, ["check", bare], cwd=work)
    none_yet = not [name for name in os.listdir(bare) if name.endswith(".h5")]
    second = kerf_runner.run(KERF, ["check", bare, "--pack"], cwd=work)
    made = [name for name in os.listdir(bare) if name.endswith(".h5")]
    right = first.returncode == second.returncode == 0 and none_yet and len(made) == 1 and "--pack" in first.stdout and \
        "run time" in second.stdout
    passed, failed = passed + right, failed + (not right)
    print(("ok      " if right else "FAILED  ") + "check makes a store only when told")

    # Files that kerf did not write are never replaced, the case itself least of all.
    held = os.path.join(work, "held")
    os.makedirs(held)
    with open(os.path.join(held, "history.csv"), "w") as file:
        file.write("precious\n")
    with open(os.path.join(good, "case.prm")) as file:
        written = file.read()
    for option in ([], ["--overwrite"]):
        for command in (["run", good], ["export", good], ["study", "stability", good]):
            name = command[0] + "_" + "".join(option).strip("-")
            expect(f"files_of_a_person_{name}", command + ["--output", held] + option, held, ".kerf_results", cwd=work)
            expect(f"case_as_results_{name}", command + ["--output", good] + option, "holds the case itself", cwd=work)
            expect(f"case_in_results_{name}", command + ["--output", work] + option, "holds the case itself", cwd=work)
    kept = open(os.path.join(held, "history.csv")).read() == "precious\n" and open(os.path.join(good, "case.prm")).read() == written
    print(("ok      " if kept else "FAILED  ") + "nothing of a person was changed")

    # Results are replaced when told; as a case they are not their own results.
    results = os.path.join(work, "results_of_a_run")
    run = ["run", good, "--set", "Time/End time=1e-7", "--output", results]
    first, refused = kerf_runner.run(KERF, run, cwd=work), kerf_runner.run(KERF, run, cwd=work)
    again = kerf_runner.run(KERF, run + ["--overwrite"], cwd=work)
    as_case = kerf_runner.run(KERF, ["run", results, "--output", results, "--overwrite"], cwd=work)
    with open(os.path.join(results, "case.prm")) as file:
        echoed = "End time" in file.read()
    codes = [one.returncode for one in (first, refused, again, as_case)]
    replaced = codes == [0, 2, 0, 2] and "--overwrite" in refused.stderr and echoed
    print(("ok      " if replaced else "FAILED  ") + f"results are replaced when told, exit codes {codes}")
    passed, failed = passed + kept + replaced, failed + (not kept) + (not replaced)

    # Old names of keys and values are read with a notice.
    old = kerf_runner.run(KERF, ["check", good, "--set", "Coupling/Method=multipliers", "--set", "Packing/Rows along=x"], cwd=work)
    noticed = old.returncode == 0 and "weak_multipliers now" in old.stdout and "Packing/Lattice rows now" in old.stdout
    print(("ok      " if noticed else "FAILED  ") + "old names are read with a notice")
    passed, failed = passed + noticed, failed + (not noticed)

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
