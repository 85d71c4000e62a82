# SPDX-License-Identifier: GPL-2.0-or-later
"""Runs kerf for the tests: on any number of ranks, in a copy of a case, with the history read back."""
import csv
import os
import re
import shutil
import subprocess


def command(kerf, arguments, ranks=1):
    prefix = []
    if ranks > 1:
        prefix = ["mpirun", "--oversubscribe"] + (["--allow-run-as-root"] if os.geteuid() == 0 else []) + ["-n", str(ranks)]
    return prefix + [kerf] + [str(argument) for argument in arguments]


def run(kerf, arguments, ranks=1, cwd=None, timeout=900):
    """CompletedProcess with text output; does not raise on an exit code."""
    return subprocess.run(command(kerf, arguments, ranks), cwd=cwd, timeout=timeout, stdin=subprocess.DEVNULL,
                          capture_output=True, text=True)


def copy_case(source, target, edit=None):
    """A copy of a case directory without its stores; edit maps the text of case.prm to a new one."""
    shutil.copytree(source, target, ignore=shutil.ignore_patterns("*.h5", "specimens"))
    if edit is not None:
        path = os.path.join(target, "case.prm")
        with open(path) as file:
            text = file.read()
        changed = edit(text)
        assert changed != text, "the edit of the case did nothing"
        with open(path, "w") as file:
            file.write(changed)
    return target


def history(directory):
    """Columns of history.csv as lists of floats."""
    with open(os.path.join(directory, "history.csv")) as file:
        assert file.readline().startswith("# units:")
        rows = list(csv.DictReader(file))
    return {name: [float(row[name]) for row in rows] for name in rows[0]}


def strengths(case):
    """The numbers of strengths.txt by their names."""
    with open(os.path.join(case, "strengths.txt")) as file:
        pairs = [line.strip().split(" = ") for line in file if " = " in line and not line.startswith("#")]
    return {name: float(value) for name, value in pairs if name != "kind"}


def timer_table(directory):
    """What the log of a finished run says of its parts: seconds and microseconds a step by name."""
    with open(os.path.join(directory, "log.txt")) as file:
        rows = re.findall(r"^ +(\S.*?) +([\d.]+) s +[\d.]+ % +([\d.]+) us/step$", file.read(), re.MULTILINE)
    assert rows, f"{directory}/log.txt has no timer table"
    return {part: (float(seconds), float(step)) for part, seconds, step in rows}


def exchange_share(parts):
    """Of a step, which changes of models and output are not."""
    return parts["exchange"][0] / sum(seconds for part, (seconds, _) in parts.items() if part not in ("activation", "output"))


def share_of_run(parts, part):
    """Of the whole run, with changes of models and output."""
    return parts[part][0] / sum(seconds for seconds, _ in parts.values())
