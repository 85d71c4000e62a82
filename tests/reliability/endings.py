#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""How the program ends: on a full disk, at a signal, when one rank alone has an error. One line, the right exit code, in time.

usage: endings.py KERF SMALL_CASE
"""
import os
import signal
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "support"))
import kerf_runner  # noqa: E402

KERF, SMALL_CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
MPIRUN = kerf_runner.command("", [], ranks=2)[:-3]  # without "-n 2" and the program
passed = failed = 0


def check(name, condition, detail=""):
    global passed, failed
    passed, failed = passed + bool(condition), failed + (not condition)
    print(("ok      " if condition else "FAILED  ") + name + (": " + detail if detail else ""))


def lines_of_kerf(text):
    """mpirun adds lines of its own about an exit code."""
    return [line for line in text.splitlines() if line.startswith("kerf:")]


def full_disk(case, work):
    """Every size of disk that fills up at another file."""
    disk = os.path.join(work, "disk")
    os.makedirs(disk)
    for size, mode in (("16k", "fem"), ("64k", "fem"), ("130k", "fem"), ("64k", "dem"), ("130k", "dem"), ("300k", "dem")):
        if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=" + size, "tmpfs", disk], capture_output=True).returncode != 0:
            print("skipped full disks: no permission to mount one")
            return
        try:
            ranks = 2 if mode == "dem" and size == "130k" else 1
            result = kerf_runner.run(KERF, ["run", case, "--mode", mode, "--output", os.path.join(disk, "r")], ranks=ranks, cwd=work,
                                     timeout=60)
        finally:
            subprocess.run(["umount", disk], check=True)
        found = lines_of_kerf(result.stderr)
        single = len(result.stderr.splitlines()) == 1 or ranks > 1
        check(f"disk of {size}, mode {mode}, {ranks} ranks", result.returncode == 2 and len(found) == 1 and single and
              "cannot be written" in found[0], f"code {result.returncode}, {found}")


def errors_of_one_rank(case, work):
    """The other rank waits in a collective call; the time limit is that of the agreement (10 s) with the start."""
    good = [KERF, "run", case, "--output", os.path.join(work, "one_rank")]
    bad = good + ["--set", "Rock/Density=-1"]
    for name, parts in (("second", (good, bad)), ("first", (bad, good))):
        command = MPIRUN + ["-n", "1", *parts[0], ":", "-n", "1", *parts[1]]
        started = time.time()
        result = subprocess.run(command, cwd=work, capture_output=True, text=True, timeout=60)
        found = lines_of_kerf(result.stderr)
        check(f"an error of the {name} rank alone ends both", result.returncode == 2 and len(found) == 1 and
              "Rock/Density" in found[0] and time.time() - started < 30., f"code {result.returncode}, {found}")
    for name, arguments in (("a directory that cannot be made", ["run", case, "--output", "/proc/results"]),
                            ("a wrong word", ["rnu", case])):
        result = kerf_runner.run(KERF, arguments, ranks=2, cwd=work, timeout=60)
        check(f"two ranks, {name}", result.returncode == 2 and len(lines_of_kerf(result.stderr)) == 1, f"code {result.returncode}")


def interrupted(case, work, ranks, number, code):
    """A long run that gets a signal after some rows."""
    name = f"{signal.Signals(number).name}_{ranks}"
    output = os.path.join(work, name)
    log = os.path.join(output, "log.txt")
    command = kerf_runner.command(KERF, ["run", case, "--mode", "dem", "--output", output, "--set", "Time/End time=1"], ranks=ranks)
    with open(os.path.join(work, name + ".out"), "w+") as out:
        # mpirun kills its ranks one second after it ends them, which is short on a machine with other work.
        patient = dict(os.environ, OMPI_MCA_odls_base_sigkill_timeout="8")
        process = subprocess.Popen(command, cwd=work, stdout=out, stderr=subprocess.DEVNULL, env=patient)
        table = os.path.join(output, "history.csv")
        while not os.path.exists(table) or len(open(table).readlines()) < 6:
            time.sleep(0.1)
            assert process.poll() is None, "the run ended before it could be interrupted"
        process.send_signal(number)
        got = process.wait(timeout=60)
        out.seek(0)
        shown = out.read()
    figure = os.path.join(output, "figures", "energy.png")
    for _ in range(300):  # those of ranks that mpirun kills are drawn beside it
        if os.path.exists(figure):
            break
        time.sleep(0.1)
    text = open(log).read()
    history = kerf_runner.history(output)
    last = f"snapshot_{int(history['step'][-1]):09d}.h5"
    check(f"{name}: exit code, summary, last row and fields, figures", got == code and "interrupted at step" in text and
          "energy balance" in text and os.path.exists(os.path.join(output, "fields", last)) and os.path.exists(figure),
          f"code {got}, {last}")
    check(f"{name}: no carriage returns in a file", "\r" not in shown and "\r" not in text)


with tempfile.TemporaryDirectory() as work:
    case = kerf_runner.copy_case(SMALL_CASE, os.path.join(work, "case"))
    assert kerf_runner.run(KERF, ["pack", case], cwd=work).returncode == 0
    full_disk(case, work)
    errors_of_one_rank(case, work)
    interrupted(case, work, 1, signal.SIGINT, 130)
    interrupted(case, work, 1, signal.SIGTERM, 130)
    # mpirun itself ends with 1 at these, and kills its ranks a second later; ./run gives it SIGUSR1.
    interrupted(case, work, 2, signal.SIGINT, 1)
    interrupted(case, work, 2, signal.SIGTERM, 1)
    interrupted(case, work, 2, signal.SIGUSR1, 130)
    with open("/dev/full", "w") as full:
        result = subprocess.run([KERF, "params"], stdout=full, stderr=subprocess.PIPE, text=True)
    check("standard output on a full disk", result.returncode == 2 and len(lines_of_kerf(result.stderr)) == 1, result.stderr.strip())

print(f"{passed} passed, {failed} failed")
sys.exit(failed > 0)
