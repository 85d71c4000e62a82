#!/usr/bin/python3
# SPDX-License-Identifier: GPL-2.0-or-later
"""Figures from synthetic results: they exist, have their size, show what they should; bad input gives one line."""
import struct
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np

SCRIPT = Path(__file__).resolve().parents[2] / "coupler" / "application" / "plots" / "figures.py"
sys.path[:0] = [str(SCRIPT.parent), str(SCRIPT.parents[3] / "tests" / "support")]
from matplotlib.image import imread  # noqa: E402
from figures import LINE_COLOURS, MORE_COLOURS  # noqa: E402
from results_file import History, first_contact, running_mean, sigma_star, steady_window, time_mean  # noqa: E402
from synthetic_results import write_results  # noqa: E402

CURVES = {"normal_force.png": (1500, 1020), "cost.png": (1500, 1200), "energy.png": (1500, 990)}
PICTURES = ("interface.png", "final.png")


def figures(*arguments):
    return subprocess.run([sys.executable, str(SCRIPT), *map(str, arguments)], capture_output=True, text=True, check=False)


def png_size(path):
    """(width, height) from the header of a PNG file."""
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n", f"{path} is not a PNG file"
    return struct.unpack(">II", data[16:24])


def reddish(path):
    """Number of pixels in the colours of damaged particles, without the colour bars (the lowest 1.6 inches at 200 dpi)."""
    red, green, blue = imread(path)[:-320, :, :3].transpose(2, 0, 1)
    return int(np.sum((red > 0.7) & (green < 0.5) & (blue < 0.3)))


class Series(unittest.TestCase):
    def test_running_mean_of_a_line_is_the_line(self):
        line = np.linspace(2., 5., 101)
        # Centred means keep a line, also at the ends, where they cover fewer values.
        np.testing.assert_allclose(running_mean(line, 9), line, rtol=1e-13)

    def test_running_mean_begins_as_the_values_do(self):
        late = np.concatenate((np.zeros(3), np.full(40, 7.)))
        self.assertEqual(running_mean(late, 21)[0], 0.)

    def test_running_mean_removes_a_whole_period(self):
        wave = np.sin(2. * np.pi * np.arange(210) / 21.)
        self.assertLess(np.abs(running_mean(wave, 21)[10:-10]).max(), 1e-13)

    def test_steady_window_is_the_second_half_after_contact(self):
        time = np.linspace(0., 10., 101)
        force = np.where(time > 3.95, -5., 0.)
        self.assertAlmostEqual(first_contact(time, force), 4.)
        np.testing.assert_allclose(steady_window(time, force), [7., 10.])

    def test_time_mean_of_uneven_output(self):
        time = np.array([0., 1., 2., 2.1, 2.2, 2.3, 4.])
        # A line over [0, 4] has its middle value as mean, however the output is spread.
        self.assertAlmostEqual(time_mean(time, 3. * time, 0., 4.), 6.)


class Figures(unittest.TestCase):
    def setUp(self):
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.directory = Path(temporary.name) / "run"

    def check_png(self, name, size=None):
        path = self.directory / "figures" / name
        self.assertGreater(path.stat().st_size, 10_000, name)
        width, height = png_size(path)
        if size:
            self.assertEqual((width, height), size, name)
        else:
            self.assertTrue(1300 <= width <= 2600 and 500 <= height <= 3000, f"{name}: {width} x {height}")

    def check_all(self):
        result = figures(self.directory)
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        for name, size in CURVES.items():
            self.check_png(name, size)
        for name in PICTURES:
            self.check_png(name)
        return result

    def test_modes(self):
        """Damaged particles are to be seen wherever there are particles, and only there."""
        for mode in ("adaptive", "fixed", "dem", "fem"):
            with self.subTest(mode=mode):
                write_results(self.directory, mode, snapshots=2, rows=200)
                self.check_all()
                count = reddish(self.directory / "figures" / "final.png")
                if mode == "fem":
                    self.assertEqual(count, 0)
                else:
                    # Some 10 000 with these data; none when the particles are not drawn or not coloured.
                    self.assertGreater(count, 5_000)

    def test_number_of_panels(self):
        """Of five snapshots four are drawn in two rows, of twelve there are six in three rows."""
        heights = []
        for count in (1, 5, 12):
            write_results(self.directory, "adaptive", snapshots=count, rows=50)
            self.check_all()
            heights.append(png_size(self.directory / "figures" / "interface.png")[1])
        self.assertGreater(heights[2], heights[1] + 300)

    def test_run_that_was_interrupted(self):
        """Columns of unequal length are cut to the shortest one; optional columns and data sets may be missing."""
        write_results(self.directory, "adaptive", snapshots=2, rows=100)
        with h5py.File(self.directory / "history.h5", "a") as file:
            values = file["time"][:73]
            del file["time"], file["overlap_particles"], file["energy_coupling"]
            file["time"] = values
        with h5py.File(sorted((self.directory / "fields").glob("snapshot_*.h5"))[-1], "a") as file:
            for name in ("particle_weight", "particle_damage", "bond_broken_position", "cell_stress"):
                del file[name]
            del file.attrs["tool_center"]
        self.check_all()

    def test_rows_that_hdf5_does_not_have_yet(self):
        """A run that was killed: history.csv is ahead of history.h5."""
        write_results(self.directory, "adaptive", snapshots=1, rows=50)
        before = History(self.directory)
        with open(self.directory / "history.csv", "w") as table:
            table.write("# units\n" + ",".join(before.columns) + "\n")
            for row in range(60):
                table.write(",".join(str(row) for _ in before.columns) + "\n")
        after = History(self.directory)
        self.assertEqual((before.rows, after.rows, after["time"][-1]), (50, 60, 59.))

    def test_no_colour_twice(self):
        """Also with the black line of the tool's work."""
        colours = LINE_COLOURS + MORE_COLOURS + ["black"]
        self.assertEqual(len(set(colours)), len(colours))
        self.assertGreaterEqual(len(colours), 16)

    def test_sigma_star(self):
        self.assertIsNone(sigma_star(self.directory))
        self.directory.mkdir(exist_ok=True)
        (self.directory / "case.prm").write_text("subsection Adaptivity\n  set Sigma star = 3e6 # default: 0\nend\n")
        self.assertEqual(sigma_star(self.directory), 3e6)

    def test_units_of_two_dimensions(self):
        """The history says N; it is per metre when the mesh is two-dimensional."""
        write_results(self.directory, "fem", snapshots=0)
        self.assertEqual(History(self.directory).units["tool_force_y"], "N")
        write_results(self.directory, "fem", snapshots=1)
        units = History(self.directory).units
        self.assertEqual((units["tool_force_y"], units["work_tool"], units["time"]), ("N/m", "J/m", "s"))

    def test_nothing_but_a_short_history(self):
        write_results(self.directory, "adaptive", snapshots=0, rows=1)
        result = figures(self.directory)
        self.assertEqual(result.returncode, 0)
        self.assertIn("no snapshots in fields/", result.stdout)
        self.assertIn("1 rows", result.stdout)

    def test_compare(self):
        runs = [write_results(self.directory / mode, mode, snapshots=0) for mode in ("dem", "adaptive")]
        (self.directory / "figures").mkdir()
        result = figures("--compare", *runs, "--labels", "full DEM", "adaptive", "--output",
                         self.directory / "figures" / "overlay.png")
        self.assertEqual((result.returncode, result.stderr), (0, ""))
        self.check_png("overlay.png", (1500, 750))

    def refused(self, *arguments, text):
        result = figures(*arguments)
        self.assertEqual(result.returncode, 1)
        self.assertEqual(result.stderr.count("\n"), 1, result.stderr)
        self.assertIn(text, result.stderr)

    def test_unreadable_input(self):
        self.refused(self.directory, text="there is no history.h5")
        write_results(self.directory, "fem", snapshots=0)
        self.refused("--compare", self.directory, "--output", "x.png", "--column", "nonsense", text="nonsense")
        history = self.directory / "history.h5"
        data = history.read_bytes()
        history.write_bytes(data[:len(data) // 3])
        self.refused(self.directory, text="history.h5")
        write_results(self.directory, "fem", snapshots=0)
        with h5py.File(history, "a") as file:
            del file["time"]
        self.refused(self.directory, text="'time'")
        write_results(self.directory, "fem", snapshots=2)
        (self.directory / "fields" / "snapshot_000005000.h5").write_text("not HDF5")
        self.refused(self.directory, text="snapshot_000005000.h5")
        (self.directory / "fields" / "mesh.h5").write_text("not HDF5")
        self.refused(self.directory, text="mesh.h5")


if __name__ == "__main__":
    unittest.main(verbosity=2)
