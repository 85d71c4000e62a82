#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""What a run or a script must not do in silence: unstable steps, cells inside out, tools in the rock, scrambled bonds.

usage: limits_of_runs.py KERF SMALL_CASE
"""
import os
import re
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
passed = failed = 0


def check(name, condition, text=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + str(text) if text != "" else ""))


def kerf(command, directory, *settings, more=(), ranks=1):
    words = [command, directory, *more]
    for setting in settings:
        words += ["--set", setting]
    return kerf_runner.run(KERF, words, ranks=ranks, cwd=work)


def error_of(result):
    lines = [line for line in result.stderr.splitlines() if line.startswith("kerf:")]
    return lines[0] if len(lines) == 1 else result.stderr


def edit(path, old, new):
    with open(path) as file:
        text = file.read()
    assert old in text, old
    with open(path, "w") as file:
        file.write(text.replace(old, new))


def test_steps():
    """The stable step knows dashpots and local damping: the limit of a run is that of the runs."""
    quiet = ("Tool/Kind=none", "Loads/Gravity=0, -10", "Time/End time=3e-5")
    for damping in ("Bond/Damping ratio=1|Bond/Local damping=0", "Bond/Damping ratio=0.3|Bond/Local damping=0.8"):
        pair = damping.split("|")
        result = kerf("check", case, "Time/Safety=0.99", *pair, *quiet, more=["--mode", "dem"])
        limit = float(re.search(r"this mode ([0-9.e+-]+) s", result.stdout)[1])
        above = kerf("run", case, f"Time/Time step={1.02 * limit}", *pair, *quiet, more=["--mode", "dem", "--output", "r", "--overwrite"])
        check(f"a step above the limit is refused, {damping}", above.returncode == 2 and "Time/Time step" in above.stderr and
              "Local damping" in above.stderr, error_of(above))
        for mode in ("dem", "adaptive"):
            whole = kerf("run", case, "Time/Safety=0.99", *pair, "Time/End time=6e-5", more=["--mode", mode, "--output", "r", "--overwrite"])
            check(f"the largest step is stable in mode {mode}, {damping}", whole.returncode == 0, error_of(whole) or f"{limit:.4g} s")
    refused = kerf("check", case, "Coupling/Method=penalty_mass_scaled", "Coupling/Penalty ratio=1.5", "Coupling/Interface damping=1")
    check("damping that is unstable at any step is refused", refused.returncode == 2 and "Interface damping" in refused.stderr, error_of(refused))


def test_inside_out():
    deep = "Tool/Path=0 0.024 0.046; 4e-4 0.024 0.015"
    for ranks in (1, 2):
        result = kerf("run", case, deep, more=["--mode", "fem", "--output", "r", "--overwrite"], ranks=ranks)
        check(f"cells inside out end a run on {ranks} rank(s)", result.returncode == 3 and
              re.search(r"t = [0-9.e-]+ s: cell \d+ around \([0-9.e, -]+\) m has turned inside out", result.stderr), error_of(result))


def test_tool():
    def start(path, *more):
        return kerf("check", case, "Tool/Path=" + path, *more, more=["--mode", "fem"])
    check("a disc that touches the surface may start", start("0 0.024 0.044").returncode == 0)
    moved = start("0 0.024 0.044; 4e-4 0.024 0.0433")
    # The path moves by v T/8 before the start: 1.75 m/s times 5e-5 s/8.
    check("the message tells how far the smoothing has moved the path",
          moved.returncode == 2 and "1.09375e-05 m" in moved.stderr and "Smoothing time" in moved.stderr, error_of(moved))
    check("as far away as the message says is enough", start(f"0 0.024 {0.044 + 1.0938e-05}; 4e-4 0.024 {0.0433 + 1.0938e-05}").returncode == 0)
    none = kerf("check", case, "Tool/Friction=0.3", "Tool/Damping ratio=0", more=["--mode", "fem"])
    check("friction without its dashpot is refused", none.returncode == 2 and "Tool/Damping ratio" in none.stderr, error_of(none))
    check("no friction needs no dashpot",
          kerf("check", case, "Tool/Friction=0", "Tool/Damping ratio=0", more=["--mode", "fem"]).returncode == 0)
    # 20 000 way points on the straight path of two: the same cut, and no slower by more than a factor of timing noise.
    def run(n):
        path = "; ".join(f"{4e-4 * k / n:.9g} 0.024 {0.0442 - 0.0009 * k / n:.9g}" for k in range(n + 1))
        edited = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, f"path_{n}"),
                                       lambda text: re.sub(r"set Path .*", f"set Path = {path}", text))
        begin = time.time()
        result = kerf("run", edited, more=["--mode", "fem", "--output", f"r_{n}"])
        assert result.returncode == 0, result.stderr
        return time.time() - begin, kerf_runner.history(os.path.join(work, f"r_{n}"))["tool_force_y"]
    few, many = run(1), run(20000)
    check("20 000 way points cost no more than two", many[0] < 3. * few[0] + 2., f"{many[0]:.1f} s and {few[0]:.1f} s")
    check("and lead to the same force", max(abs(a - b) for a, b in zip(few[1], many[1])) < 1e-4 * max(few[1]))


def test_scripts():
    spaced = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "my rock"))
    check("export of a path with blanks", kerf("export", spaced, more=["--output", "x"]).returncode == 0)
    folder = os.path.join(work, "x")
    with open(os.path.join(folder, "in.kerf")) as file:
        head, tail = re.split(r"^run .*$", file.read(), flags=re.M)[:2]

    def script(end, change=lambda text: text, where=None, ranks=1):
        with open(os.path.join(where or folder, "in.test"), "w") as file:
            file.write(change(head) + end)
        words = ["liggghts", "-in", "in.test", "-log", "none"]
        return kerf_runner.run(KERF, words, ranks=ranks, cwd=where or folder)

    def rows(result):
        """Numbers of the lines of the log that begin with a step."""
        return [[float(word) for word in line.split()] for line in result.stdout.splitlines() if re.match(r" +\d+( +[-0-9.e+]+)+ *$", line)]

    plain = script("run 50\n")
    check("it runs", plain.returncode == 0, error_of(plain))
    large = script("run 50\n", lambda text: re.sub(r"timestep +\S+", "timestep 1e-5", text))
    check("a step 100 times too large is refused", large.returncode == 2 and "allow at most" in large.stderr, error_of(large))
    group = "run 200\ngroup cut id 1596\ndelete_atoms group cut "
    scrambled = script(group + "\nrun 50\n")
    check("renumbered particles are refused", scrambled.returncode == 2 and "compress no" in scrambled.stderr, error_of(scrambled))
    kept = script(group + "compress no\nrun 50\n")
    check("delete_atoms with compress no keeps the other bonds", kept.returncode == 0 and rows(kept)[-1][7] > 3570., rows(kept)[-1:])
    local = script("compute p all pair/gran/local id force\ndump l all local 50 l.dump c_p[1]\nrun 50\n")
    check("compute pair/gran/local is refused", local.returncode == 2 and "pair/gran/local" in local.stderr, error_of(local))
    tallies = ("compute e all pe\ncompute t all temp\ncompute p all pressure t virial\ncompute ea all pe/atom\n"
               "compute er all reduce sum c_ea\ncompute s all stress/atom virial\ncompute r all reduce sum c_s[1] c_s[2] c_s[4]\n"
               "thermo_style custom step c_e f_rock_bond[2] c_er c_p[1] c_p[2] c_p[4] c_r[1] c_r[2] c_r[3] vol\n"
               "thermo_modify lost ignore norm no format float %.12g\nthermo 100\nrun 300\n")
    for ranks in (1, 2):
        result = script(tallies, ranks=ranks)
        last = rows(result)[-1] if result.returncode == 0 else [0.] * 11
        # The elastic energy is summed apart by the fix. The two tallies are the same sums in another order.
        check(f"energies are those of the bonds on {ranks} rank(s)", last[2] > 0. and abs(last[1] - last[2]) < 1e-9 * last[2] and
              abs(last[3] - last[2]) < 1e-9 * last[2], error_of(result) or last[1:4])
        check(f"pressure times volume is minus the sum of the stresses on {ranks} rank(s)", last[4] != 0. and
              all(abs(last[4 + k] * last[10] + last[7 + k]) < 1e-9 * abs(last[8]) for k in range(3)), last[4:])
        if ranks == 1:
            first = last
    check("both are equal on one rank and on two", all(abs(a - b) < 1e-9 * abs(first[8]) for a, b in zip(first[7:10], last[7:10])))


with tempfile.TemporaryDirectory() as work:
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "case"))
    assert kerf_runner.run(KERF, ["pack", case]).returncode == 0
    test_steps()
    test_inside_out()
    test_tool()
    test_scripts()

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
