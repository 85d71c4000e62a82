#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""kerf as LIGGGHTS: scripts with and without the rock bond, the export of a case, and contacts against the stock program.

usage: stand_alone.py KERF SMALL_CASE
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
STOCK = shutil.which("liggghts")
QUIET = ["-screen", "none", "-log", "none"]
passed = failed = 0


def check(name, condition, text=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + str(text) if text != "" else ""))


def write(path, text):
    with open(path, "w") as file:
        file.write(text)


def read(path):
    with open(path) as file:
        return file.read()


def last_dump(path):
    """Columns after the id and the type, sorted by id, of the last snapshot."""
    block = read(path).split("ITEM: ATOMS ")[-1].splitlines()[1:]
    rows = np.array([[float(word) for word in line.split()] for line in block])
    return rows[np.argsort(rows[:, 0])][:, 2:]


def run_script(program, script, ranks=1):
    """program: arguments before -in."""
    if ranks > 1:
        program = kerf_runner.command(program[0], program[1:], ranks)
    return subprocess.run([*program, "-in", script, *QUIET], cwd=work, stdin=subprocess.DEVNULL, capture_output=True, text=True,
                          timeout=300)


# ---- contacts of particles that were never bonded ------------------------------------------------------------------------

K_N, K_T, FRICTION, RADIUS, DENSITY = 1e6, 0.3e6, 0.4, 0.5e-3, 2500.
MASS = DENSITY * 4. / 3. * np.pi * RADIUS**3
STEP = 0.05 * np.sqrt(MASS / K_N)
STOCK_CONTACT = f"""
fix kn all property/global kn peratomtypepair 2 {K_N} {K_N} {K_N} {K_N}
fix kt all property/global kt peratomtypepair 2 {K_T} {K_T} {K_T} {K_T}
fix gn all property/global gamman peratomtypepair 2 0 0 0 0
fix gt all property/global gammat peratomtypepair 2 0 0 0 0
fix mu all property/global coefficientFriction peratomtypepair 2 {FRICTION} {FRICTION} {FRICTION} {FRICTION}
pair_style gran model hooke/stiffness tangential history tangential_damping off
"""
ROCK_CONTACT = f"pair_style gran model kerf_rock_bond k_n {K_N} k_t {K_T} friction {FRICTION}\n"


def contact_script(name, contact, body, steps, dt):
    """Script whose particles come from name.data; types: 1 moves freely, 2 is held or driven."""
    path = os.path.join(work, name)
    write(path, f"""units si
atom_style granular
atom_modify map array
boundary f f f
newton off
communicate single vel yes
read_data {body['data']}
neighbor {0.5 * RADIUS} bin
neigh_modify delay 0
{contact}
pair_coeff * *
timestep {dt!r}
group driven type 2
group moving type 1
{body['motion']}
fix motion moving nve/sphere
thermo_style custom step atoms ke
thermo_modify lost ignore
dump d all custom {steps} {name}.dump id type x y z vx vy vz omegax omegay omegaz
dump_modify d format "%d %d %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g %.17g"
run {steps}
""")
    return name


def write_particles(name, positions, types, radii):
    low, high = positions.min(axis=0) - 20 * RADIUS, positions.max(axis=0) + 20 * RADIUS
    lines = ["particles", "", f"{len(positions)} atoms", "2 atom types", ""]
    lines += [f"{low[c]!r} {high[c]!r} {'xyz'[c]}lo {'xyz'[c]}hi" for c in range(3)] + ["", "Atoms", ""]
    lines += [f"{k + 1} {types[k]} {2 * radii[k]!r} {DENSITY} {x[0]!r} {x[1]!r} {x[2]!r}" for k, x in enumerate(positions)]
    write(os.path.join(work, name), "\n".join(lines) + "\n")
    return name


def compare_contacts(name, body, steps, dt):
    """Largest difference of positions [m] and spins [rad/s] between stock LIGGGHTS and the rock bond, and of the motion itself."""
    results = []
    for program, contact, label in (([STOCK], STOCK_CONTACT, "stock"), ([KERF, "liggghts"], ROCK_CONTACT, "kerf")):
        script = contact_script(f"{name}_{label}", contact, body, steps, dt)
        result = run_script(program, script)
        assert result.returncode == 0, result.stdout + result.stderr
        results.append(last_dump(os.path.join(work, script + ".dump")))
    stock, kerf = results
    return (np.abs(stock[:, :3] - kerf[:, :3]).max(), np.abs(stock[:, 6:] - kerf[:, 6:]).max(), np.abs(stock[:, 6:]).max())


def test_contacts():
    # A spinning sphere is pinched between two driven ones: it slides, sticks and swings. The normals never turn, so both
    # formulations are the same arithmetic: round-off of 1000 steps.
    x = np.array([[-2.001 * RADIUS, 0, 0], [0, 0, 0], [2.001 * RADIUS, 0, 0]])
    speed = 0.02 * RADIUS / (1000 * STEP)
    start = 40. * speed / RADIUS
    pinch = {"data": write_particles("pinch.data", x, [2, 1, 2], [RADIUS] * 3),
             "motion": f"group left id 1\ngroup right id 3\ngroup middle id 2\n"
                       f"fix l left move linear {speed!r} 0 0 units box\nfix r right move linear {-speed!r} 0 0 units box\n"
                       f"set group middle omegaz {start!r}"}
    difference, spin, largest = compare_contacts("pinch", pinch, 1000, STEP)
    check("pinched sphere: stock contacts to round-off", difference < 1e-12 * RADIUS and spin < 1e-9 * start,
          f"{difference / RADIUS:.1e} radii, spin {spin / start:.1e}")
    check("pinched sphere: friction acts", largest < 0.9 * start, f"{largest / start:.2f} of the spin is left")

    # Where normals turn, the formulations differ: the stock model takes the part of the tangential spring along the new normal
    # away, the rock bond turns the spring without changing its length. That is half the square of the turn in a step, so the
    # difference is proportional to the step.
    x = np.array([[0, 0, 0], [1.95 * RADIUS, 0.6 * RADIUS, 0]])
    speed = 6e-3 * RADIUS / STEP
    oblique = {"data": write_particles("oblique.data", x, [1, 1], [RADIUS] * 2),
               "motion": f"group first id 1\nvelocity first set {speed!r} 0 0 units box"}
    by_step = [compare_contacts("oblique", oblique, 100 * 2**halving, STEP / 2**halving)[0] for halving in range(2)]
    check("oblique impact: stock contacts to first order in the step", by_step[0] < 1e-6 * RADIUS and
          abs(by_step[1] / by_step[0] - 0.5) < 0.05, f"{by_step[0] / RADIUS:.1e} and {by_step[1] / RADIUS:.1e} radii")

    # A bed sheared and pressed between a held and a driven layer: 144 free spheres, 1000 steps, 0.15 radii. Collisions magnify
    # the difference of the formulations by about 10 each, hence 1e-3 radii.
    rng = np.random.default_rng(5)
    n = 6
    grid = np.array([[i, j, k] for k in range(n) for j in range(n) for i in range(n)], dtype=float)
    x = (2.02 * grid + rng.uniform(-0.05, 0.05, grid.shape) * (grid[:, 2:] % (n - 1) > 0)) * RADIUS
    types = [2 if k in (0, n - 1) else 1 for k in grid[:, 2]]
    top = " ".join(str(k + 1) for k, place in enumerate(grid) if place[2] == n - 1)
    speed = 6e-4 * RADIUS / STEP
    bed = {"data": write_particles("bed.data", x, types, [RADIUS] * len(x)),
           "motion": f"group top id {top}\ngroup floor subtract driven top\n"
                     f"fix top top move linear {speed!r} {0.2 * speed!r} {-0.6 * speed!r} units box\n"
                     "fix floor floor move linear 0 0 0 units box"}
    difference, spin, largest = compare_contacts("bed", bed, 1000, STEP / 4)
    check("sheared bed: stock contacts within 1e-3 radii", difference < 1e-3 * RADIUS and spin < 0.05 * largest,
          f"{difference / RADIUS:.1e} radii, spin {spin / largest:.1e}")


# ---- scripts -------------------------------------------------------------------------------------------------------------

def test_stock_behaviour():
    """Same input, same output: results, log and exit code."""
    x = np.array([[0, 0, 0], [1.9 * RADIUS, 0.3 * RADIUS, 0]])
    body = {"data": write_particles("two.data", x, [1, 1], [RADIUS, 1.3 * RADIUS]), "motion": ""}
    logs, dumps = [], []
    script = contact_script("two", STOCK_CONTACT.replace("gamman peratomtypepair 2 0 0 0 0", "gamman peratomtypepair 2 9 9 9 9"),
                            body, 200, STEP)
    for program in ([STOCK], [KERF, "liggghts"]):
        result = subprocess.run([*program, "-in", script, "-log", "log.txt", "-var", "unused", "1"], cwd=work,
                                capture_output=True, text=True, timeout=100)
        untimed = [line for line in read(os.path.join(work, "log.txt")).splitlines()
                   if not re.search(r"time|Setting up run|CPU|Memory|memory", line)]
        logs.append((result.returncode, untimed))
        dumps.append(read(os.path.join(work, "two.dump")))
    check("a script without the rock bond gives the same log", logs[0] == logs[1],
          [pair for pair in zip(*[log[1] for log in logs]) if pair[0] != pair[1]] or f"{len(logs[0][1])} lines")
    check("a script without the rock bond gives the same particles", dumps[0] == dumps[1])
    write(os.path.join(work, "wrong"), "units si\nno_such_command\n")
    codes = [subprocess.run([*program, "-in", "wrong", "-log", "none"], cwd=work, capture_output=True)
             for program in ([STOCK], [KERF, "liggghts"])]
    # Behind its message LIGGGHTS prints memory that it never set.
    messages = [(done.returncode, [line for line in done.stdout.splitlines() if line.startswith(b"ERROR")]) for done in codes]
    check("an error of LIGGGHTS ends alike", messages[0] == messages[1] and messages[0][0] != 0 and messages[0][1], messages[1])


def test_bad_lines(script, good_line):
    def bad(name, line, *words, ranks=1):
        write(os.path.join(work, "bad"), script.replace(good_line, line))
        result = run_script([KERF, "liggghts"], "bad", ranks)
        lines = [text for text in result.stderr.splitlines() if text.startswith("kerf:")]
        missing = [word for word in words if word not in result.stderr]
        check("bad line: " + name, result.returncode == 2 and len(lines) == 1 and not missing, (lines or [result.stderr])[0])

    start = "pair_style gran model kerf_rock_bond "
    bad("unknown key", start + "kn 1e9 k_t 1e9", "'kn'", "k_n, k_t")
    bad("unknown key on two ranks", start + "kn 1e9 k_t 1e9", "'kn'", "k_n, k_t", ranks=2)
    bad("missing key", start + "k_n 1e9", "k_t is missing")
    bad("no number", start + "k_n much k_t 1e9", "'much'", "> 0")
    bad("out of range", start + "k_n 1e9 k_t 1e9 local_damping 1", "local_damping", "[0, 1)")
    bad("odd words", start + "k_n 1e9 k_t", "k_t", "no value")
    bad("given twice", start + "k_n 1e9 k_n 1e9", "twice")
    bad("store without strength", start + "k_n 1e9 k_t 1e9 store bonds.h5", "R_n is missing")
    bad("no such store", start + "k_n 1e9 k_t 1e9 R_n 1 R_t 1 store nowhere.h5", "nowhere.h5")
    bad("tool of no case", good_line + "\npair_coeff * *\nfix cutter all kerf/tool case nowhere k_n 1", "fix cutter", "nowhere")
    bad("tool without stiffness", good_line + "\npair_coeff * *\nfix cutter all kerf/tool case . k_m 1", "k_m", "k_n STIFFNESS")
    bad("list reach", good_line + "\nneigh_modify contact_distance_factor 1.0", "contact_distance_factor", "at least")
    write(os.path.join(work, "bad"), "units si\natom_style granular\n" + start + "k_n 1 k_t 1\n")
    result = run_script([KERF, "liggghts"], "bad")
    check("bad line: before the box", result.returncode == 2 and "after the box" in result.stderr, result.stderr.strip())


def test_export():
    """The small cut with all kinds of boundaries: 1000 steps by kerf run --mode dem and by the script."""
    options = ["--set", "Time/Time step=8e-8", "--set", "Time/End time=8e-5", "--set", "Output/Snapshots=1", "--set",
               "Boundary/Conditions=left: absorbing; right: roller; bottom: velocity 0.3 0.6 ramp 2e-5"]
    output = os.path.join(os.path.dirname(work), "run")
    result = kerf_runner.run(KERF, ["run", case, "--mode", "dem", "--output", output, *options])
    assert result.returncode == 0, result.stderr
    result = kerf_runner.run(KERF, ["export", case, "--output", work, *options])
    check("export ends well", result.returncode == 0, result.stderr.strip())
    again = kerf_runner.run(KERF, ["export", case, "--output", work, *options])
    check("export does not overwrite", again.returncode == 2 and "--overwrite" in again.stderr, again.stderr.strip())
    script = read(os.path.join(work, "in.kerf"))
    write(os.path.join(work, "precise"), script.replace("%.10g", "%.17g"))

    final = sorted(name for name in os.listdir(os.path.join(output, "fields")) if name.startswith("snapshot"))[-1]
    with h5py.File(os.path.join(output, "fields", final)) as file:
        order = np.argsort(file["particle_index"][:])
        position, velocity = file["particle_position"][:][order], file["particle_velocity"][:][order]
    history = kerf_runner.history(output)
    with h5py.File(os.path.join(case, next(name for name in os.listdir(case) if name.endswith(".h5")))) as file:
        moved = np.abs(position - file["positions"][:]).max()
    for ranks in (1, 2):
        result = run_script([KERF, "liggghts"], "precise", ranks)
        check(f"exported script runs on {ranks} rank(s)", result.returncode == 0, result.stderr.strip())
        dump = last_dump(os.path.join(work, "particles.dump"))
        difference = np.abs(dump[:, 1:4] - position).max()
        # Driven particles end a step with the velocity of the next half step in mode dem, with that of the last one in a script;
        # the ramp is over, so they are equal. Other differences are the order of sums: 1e-16 a step, magnified where bonds
        # break (10 bonds and more do), hence not 1e-15 of the displacement.
        check(f"exported script moves as mode dem on {ranks} rank(s)", difference < 1e-9 * moved,
              f"{difference / moved:.1e} of the largest displacement {moved:.2e} m")
        check(f"exported script ends with the velocities of mode dem on {ranks} rank(s)",
              np.abs(dump[:, 4:7] - velocity).max() < 1e-8 * np.abs(velocity).max(), np.abs(dump[:, 4:7] - velocity).max() / np.abs(velocity).max())
        check(f"broken bonds are the same on {ranks} rank(s)",
              abs(dump[:, 10].sum() - 2 * history["broken_bonds"][-1]) < 0.5 and history["broken_bonds"][-1] > 10,
              history["broken_bonds"][-1])
    good_line = re.search(r"pair_style .*?store \S+\n", script, re.S)[0].rstrip("\n")
    test_bad_lines(script, good_line)


with tempfile.TemporaryDirectory() as top:
    work = os.path.join(top, "scripts")
    os.makedirs(work)
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(top, "case"))
    test_export()
    if STOCK is None:
        print("skipped the comparison with stock LIGGGHTS: there is no program liggghts (Debian package liggghts)")
    else:
        test_stock_behaviour()
        test_contacts()

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
