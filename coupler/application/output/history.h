// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/output/specimen_gauge.h"

#include <fstream>
#include <string>
#include <vector>

namespace kerf
{
/// One row of the history.
struct HistoryRow
{
  std::int64_t step = 0;
  double time = 0., wall_time = 0., cpu_time = 0.;
  Eigen::Vector3d tool_force = Eigen::Vector3d::Zero();
  int active_particles = 0, overlap_particles = 0, converted_cells = 0;
  std::int64_t intact_bonds = 0, broken_bonds = 0;
  EnergyLedger energy;
  SpecimenState specimen; ///< between platens only
};

/// A column of the history. Name, unit and value are defined together, so the header always matches the numbers.
struct HistoryColumn
{
  std::string name, unit, meaning;
  double (*value)(const HistoryRow &);
};
const std::vector<HistoryColumn> &history_columns();

/// The force on the tool along an axis. Its steady part is the second half of the time in contact: from the first to the last
/// time at which the force exceeds a thousandth of its peak. The figures use the same.
struct ForceSummary
{
  double mean = 0.;            ///< of the steady part, by the trapezoidal rule [N]
  double start = 0., end = 0.; ///< of the steady part [s]
  double peak = 0.;            ///< the value of the largest magnitude [N]
  double peak_time = 0.;       ///< [s]
};
ForceSummary summarise_force(const std::vector<HistoryRow> &rows, int axis);

/// Writes history.csv row by row, so that it is readable during the run, and history.h5 at every flush().
class History
{
public:
  explicit History(const std::string &directory);
  void add(const HistoryRow &row);
  void flush() const;
  const std::vector<HistoryRow> &rows() const { return all; }

private:
  std::string directory;
  std::ofstream csv;
  std::vector<HistoryRow> all;
};
} // namespace kerf
