// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/output/specimen_gauge.h"

#include <fstream>
#include <string>
#include <vector>

namespace kerf
{
/// One line of the history.
struct HistoryRow
{
  std::int64_t step = 0;
  double time = 0., wall_time = 0.;
  Eigen::Vector3d tool_force = Eigen::Vector3d::Zero();
  int active_particles = 0, overlap_particles = 0, converted_cells = 0;
  std::int64_t intact_bonds = 0, broken_bonds = 0;
  EnergyLedger energy;
  SpecimenState specimen; ///< between platens only
};

/// A column: its name, unit and value are written down in one place, so header and numbers cannot drift apart.
struct HistoryColumn
{
  std::string name, unit, meaning;
  double (*value)(const HistoryRow &);
};
const std::vector<HistoryColumn> &history_columns();

/// history.csv is written row by row (readable while the run goes on), history.h5 whenever flush() is called.
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
