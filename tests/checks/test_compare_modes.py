#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""The comparison of modes: its numbers against known curves, and the whole script with a stand-in for kerf."""
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

TESTS = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(TESTS / "studies"))
import compare_modes  # noqa: E402
from results_file import History, Unreadable  # noqa: E402

# Writes synthetic results and a line for each call, as kerf would its results.
STAND_IN = f"""#!/usr/bin/python3
import os, sys
sys.path.insert(0, {str(TESTS / "support")!r})
from synthetic_results import write_results
mode, output = sys.argv[sys.argv.index("--mode") + 1], sys.argv[sys.argv.index("--output") + 1]
if os.path.exists(output) and "--overwrite" not in sys.argv:
    sys.exit(2)
if "--fail" in sys.argv:
    sys.exit(3)
write_results(output, mode, snapshots=0, rows=300)
open(__file__ + ".log", "a").write(" ".join(sys.argv[1:]) + "\\n")
"""


def write_history(directory, time, columns):
    directory.mkdir(parents=True)
    with h5py.File(directory / "history.h5", "w") as file:
        for name, values in {"time": time, **columns}.items():
            file[name] = values
            file.attrs[f"unit_{name}"] = "N/m" if name.startswith("tool") else "1"


class Numbers(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.directory = Path(temporary.name)

    def history(self, name="run", factor=1., end=8e-3):
        """Contact at 2 ms, then a force that rises linearly from 40 to 100 kN/m at 8 ms; 1000 particles per ms."""
        time = np.linspace(0., end, 801)
        ms = time * 1e3
        write_history(self.directory / name, time, {
            "tool_force_y": factor * np.where(ms >= 2., 4e4 + 1e4 * (ms - 2.), 0.), "active_particles": 1000. * ms,
            "broken_bonds": 10. * ms, "cpu_time": 5. * ms})
        return History(self.directory / name)

    def test_window_and_summary(self):
        history = self.history()
        start, end = compare_modes.common_window([history], None)
        np.testing.assert_allclose([start, end], [5e-3, 8e-3])
        row = compare_modes.summary(history, start, end)
        # Linear curves: the trapezoidal rule is exact, so only round-off is allowed.
        self.assertAlmostEqual(row["mean_force"] / 8.5e4, 1., places=12)
        self.assertAlmostEqual(row["peak_force"] / 1e5, 1., places=12)
        self.assertAlmostEqual(row["mean_active"] / 4000., 1., places=12)
        np.testing.assert_allclose(row["quarters"], [2000., 4000., 6000., 8000.])
        self.assertAlmostEqual(row["cpu_time"], 40.)
        self.assertAlmostEqual(row["broken_bonds"], 80.)

    def test_window_ends_with_the_shortest_run(self):
        runs = [self.history("a"), self.history("b", end=6e-3)]
        np.testing.assert_allclose(compare_modes.common_window(runs, 3e-3), [3e-3, 6e-3])
        with self.assertRaises(Unreadable):
            compare_modes.common_window(runs, 7e-3)

    def test_table(self):
        runs = [self.history("dem"), self.history("adaptive", 0.9)]
        rows = [compare_modes.summary(run, 5e-3, 8e-3) for run in runs]
        lines = compare_modes.table(["dem", "adaptive"], rows, "kN/m").splitlines()
        self.assertEqual(lines[2], "| dem | 40.0 | 85.0 | +0.0 % | 100.0 | 4000 | 8000 | 2000 / 4000 / 6000 / 8000 | 80 |")
        self.assertEqual(lines[3], "| adaptive | 40.0 | 76.5 | -10.0 % | 90.0 | 4000 | 8000 | 2000 / 4000 / 6000 / 8000 | 80 |")
        self.assertEqual(len({line.count("|") for line in lines}), 1)

    def test_section_between_the_markers(self):
        document = self.directory / "results.md"
        compare_modes.put_section(document, "first\n")
        document.write_text("before\n" + document.read_text() + "after\n")
        compare_modes.put_section(document, "second\n")
        text = document.read_text()
        self.assertIn(f"{compare_modes.BEGIN}\nsecond\n{compare_modes.END}", text)
        self.assertNotIn("first", text)
        self.assertTrue(text.startswith("before\n") and text.endswith("after\n"))
        document.write_text("no markers\n")
        with self.assertRaises(Unreadable):
            compare_modes.put_section(document, "third\n")
        self.assertEqual(document.read_text(), "no markers\n")


class Script(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.directory = Path(temporary.name)
        self.kerf = self.directory / "kerf"
        self.kerf.write_text(STAND_IN)
        self.kerf.chmod(0o755)
        (self.directory / "case").mkdir()

    def run_script(self, *arguments):
        return subprocess.run([sys.executable, str(TESTS / "studies" / "compare_modes.py"), str(self.directory / "case"), "--kerf",
                               str(self.kerf), "--results", str(self.directory / "runs"), "--docs",
                               str(self.directory / "docs"), *arguments], capture_output=True, text=True, check=False)

    def calls(self):
        return (self.directory / "kerf.log").read_text().splitlines()

    def test_three_modes(self):
        result = self.run_script("--", "--set", "A/b=1")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.assertEqual([call.split()[3] for call in self.calls()], ["dem", "fixed", "adaptive"])
        self.assertTrue(all(call.endswith("--set A/b=1") for call in self.calls()))
        text = (self.directory / "docs" / "cutting.md").read_text()
        for mode in ("dem", "fixed", "adaptive"):
            self.assertIn(f"| {mode} | ", text)
        for name in ("modes_normal_force.png", "modes_active_particles.png"):
            self.assertGreater((self.directory / "docs" / "figures" / name).stat().st_size, 10_000)
        # Finished runs are kept; those with other options are neither used nor lost without --overwrite.
        self.assertEqual(self.run_script("--", "--set", "A/b=1").returncode, 0)
        self.assertEqual(len(self.calls()), 3)
        self.assertEqual(self.run_script("--", "--set", "A/b=2").returncode, 2)
        self.assertEqual(self.run_script("--overwrite", "--", "--set", "A/b=2").returncode, 0)
        self.assertEqual(len(self.calls()), 6)
        self.assertTrue(self.calls()[-1].endswith("--overwrite"))
        # A run that fails while it overwrites a finished one leaves nothing that counts as finished.
        self.assertEqual(self.run_script("--overwrite", "--", "--set", "A/b=2", "--fail").returncode, 3)
        self.assertEqual(self.run_script("--", "--set", "A/b=2").returncode, 2)

    def test_failure_of_kerf_is_passed_on(self):
        result = self.run_script("--", "--fail")
        self.assertEqual(result.returncode, 3)
        self.assertIn("mode dem", result.stderr)
        self.assertFalse((self.directory / "docs").exists())

    def test_nothing_there(self):
        result = self.run_script("--existing")
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.count("\n"), 1)


if __name__ == "__main__":
    unittest.main(verbosity=2)
