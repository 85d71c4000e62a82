#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""kerf study stability on a small case: what is predicted happens.

  maps.py KERF CASE
"""
import csv
import os
import sys
import tempfile

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "support"))
import kerf_runner  # noqa: E402

KERF, CASE = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
failures = []


def check(name, condition, text=""):
    print(f"{'ok     ' if condition else 'FAILED '} {name}" + (f": {text}" if str(text) else ""))
    if not condition:
        failures.append(name)


with tempfile.TemporaryDirectory() as work:
    case, output = os.path.join(work, "case"), os.path.join(work, "study")
    kerf_runner.copy_case(CASE, case)
    result = kerf_runner.run(KERF, ["study", "stability", case, "--output", output], timeout=800)
    check("the study ends well", result.returncode == 0, result.stderr.strip()[-300:])
    with open(os.path.join(output, "stability.csv"), newline="", encoding="utf-8") as table:
        rows = list(csv.DictReader(table))
    maps = {row["map"] for row in rows}
    check("all maps are there", maps >= {"step_penalty", "step_penalty_mass_scaled", "overlap_weight", "cell_size",
                                         "interface_damping", "fluctuation_relaxation", "local_damping", "impact_speed", "poisson"})
    check("every map has its picture", all(os.path.isfile(os.path.join(output, "figures", f"stability_{name}.png"))
                                           for name in maps))
    # Impacts near the speed of sound leave the small strains that the operator knows.
    linear = [row for row in rows if row["verdict"] != "refused" and row["map"] != "impact_speed"]
    wrong = [row for row in linear if float(row["step"]) < 0.98 * float(row["predicted_limit"]) and row["verdict"] == "unstable"]
    check("no step below the predicted limit is unstable", not wrong, wrong)
    # 600 steps are enough for growth at 1.02 of the limit; the limit of the sides does not count, it covers broken rock, too.
    wrong = [row for row in rows if row["map"].startswith("step_") and row["verdict"] != "refused" and
             float(row["step"]) > 1.02 * float(row["predicted_limit"]) and row["verdict"] != "unstable"]
    check("steps above the predicted limit are unstable", not wrong, wrong)
    slow = [row for row in rows if row["map"] == "impact_speed" and float(row["x"]) <= 0.01]
    check("impacts of a hundredth of the speed of sound are stable", all(row["verdict"] != "unstable" for row in slow))
    kept = [row for row in linear if row["verdict"] == "stable"]
    # Rollers stop the noise of their particles at the first step and do no work: some tenths of a per cent of the noise.
    check("the balance of stable runs closes to 0.5 %", all(abs(float(row["residual"])) < 5e-3 for row in kept),
          max(abs(float(row["residual"])) for row in kept))
    again = kerf_runner.run(KERF, ["study", "stability", case, "--output", output])
    check("a study is not overwritten", again.returncode == 2 and "--overwrite" in again.stderr, again.stderr.strip())
sys.exit(1 if failures else 0)
