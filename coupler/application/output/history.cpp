// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/history.h"

#include "coupler/application/output/written.h"
#include "dem_side/packing/hdf5_file.h"

#include <algorithm>
#include <cmath>
#include <iomanip>

namespace kerf
{
const std::vector<HistoryColumn> &history_columns()
{
  using Row = const HistoryRow &;
  static const std::vector<HistoryColumn> columns = {
    {"step", "1", "number of the step", [](Row r) { return static_cast<double>(r.step); }},
    {"time", "s", "simulated time", [](Row r) { return r.time; }},
    {"tool_force_x", "N", "force of the rock on the tool, mean since the last row", [](Row r) { return r.tool_force[0]; }},
    {"tool_force_y", "N", "normal force", [](Row r) { return r.tool_force[1]; }},
    {"tool_force_z", "N", "", [](Row r) { return r.tool_force[2]; }},
    {"active_particles", "1", "", [](Row r) { return double(r.active_particles); }},
    {"overlap_particles", "1", "", [](Row r) { return double(r.overlap_particles); }},
    {"converted_cells", "1", "", [](Row r) { return double(r.converted_cells); }},
    {"intact_bonds", "1", "", [](Row r) { return static_cast<double>(r.intact_bonds); }},
    {"broken_bonds", "1", "", [](Row r) { return static_cast<double>(r.broken_bonds); }},
    {"energy_kinetic", "J", "both sides", [](Row r) { return r.energy.kinetic; }},
    {"energy_elastic", "J", "both sides", [](Row r) { return r.energy.elastic; }},
    {"energy_coupling", "J", "stored in the constraint", [](Row r) { return r.energy.coupling; }},
    {"work_tool", "J", "done by the tool on the rock", [](Row r) { return r.energy.tool_work; }},
    {"energy_damping", "J", "dissipated", [](Row r) { return r.energy.damping; }},
    {"energy_friction", "J", "dissipated", [](Row r) { return r.energy.friction; }},
    {"energy_released", "J", "lost at bond failure", [](Row r) { return r.energy.released; }},
    {"energy_absorbed", "J", "absorbed by absorbing boundaries", [](Row r) { return r.energy.absorbed; }},
    {"energy_left", "J", "of particles that left the domain", [](Row r) { return r.energy.left; }},
    {"work_boundary", "J", "done by velocity boundaries", [](Row r) { return r.energy.boundary_work; }},
    {"platen_closing", "m", "of the platens since the start; pulled: their opening", [](Row r) { return r.specimen.closing; }},
    {"nominal_stress", "Pa", "force of the platens / area; a disc with the factor of its flats",
     [](Row r) { return r.specimen.stress; }},
    {"middle_stress", "Pa", "along y in the middle of a specimen", [](Row r) { return r.specimen.middle_stress; }},
    {"axial_strain", "1", "shortening (pulled: lengthening) of the middle of a specimen",
     [](Row r) { return r.specimen.axial_strain; }},
    {"lateral_strain", "1", "lateral expansion (pulled: contraction) of the middle of a specimen",
     [](Row r) { return r.specimen.lateral_strain; }},
    {"energy_finite_step", "J", "correction of energy_kinetic by the finite step, closes the balance",
     [](Row r) { return r.energy.finite_step; }},
    {"energy_interface", "J", "dissipated by the constraint, without its springs", [](Row r) { return r.energy.interface; }},
    {"energy_conversion", "J", "came in by changes of models", [](Row r) { return r.energy.conversion; }},
    {"energy_residual", "J", "missing in the balance", [](Row r) { return r.energy.residual(); }},
    {"wall_time", "s", "since the first step", [](Row r) { return r.wall_time; }},
    {"cpu_time", "s", "of the first rank since the first step", [](Row r) { return r.cpu_time; }},
  };
  return columns;
}

ForceSummary summarise_force(const std::vector<HistoryRow> &rows, int axis)
{
  ForceSummary result;
  if (rows.empty())
    return result;
  for (const HistoryRow &row : rows)
    if (std::abs(row.tool_force[axis]) > std::abs(result.peak))
    {
      result.peak = row.tool_force[axis];
      result.peak_time = row.time;
    }
  const auto touches = [&](const HistoryRow &row) { return std::abs(row.tool_force[axis]) > 1e-3 * std::abs(result.peak); };
  const auto contact = std::find_if(rows.begin(), rows.end(), touches);
  const auto release = std::find_if(rows.rbegin(), rows.rend(), touches);
  const double first = contact != rows.end() ? contact->time : rows.front().time;
  result.end = release != rows.rend() ? release->time : rows.back().time;
  result.start = 0.5 * (first + result.end);
  const auto from = std::find_if(rows.begin(), rows.end(), [&](const HistoryRow &row) { return row.time >= result.start; });
  double integral = 0.;
  for (auto row = from; row + 1 != rows.end() && row->time < result.end; ++row)
    integral += 0.5 * (row->tool_force[axis] + (row + 1)->tool_force[axis]) * ((row + 1)->time - row->time);
  const double duration = result.end - from->time;
  result.mean = duration > 0. ? integral / duration : from->tool_force[axis];
  return result;
}

History::History(const std::string &directory) : directory(directory), csv(directory + "/history.csv")
{
  csv << "# units:";
  for (const HistoryColumn &column : history_columns())
    csv << ' ' << column.name << " [" << column.unit << "]";
  csv << "; two-dimensional runs are per metre of thickness\n";
  for (std::size_t c = 0; c < history_columns().size(); ++c)
    csv << (c > 0 ? "," : "") << history_columns()[c].name;
  csv << '\n' << std::setprecision(12);
  check_written(csv, directory + "/history.csv");
}

void History::add(const HistoryRow &row)
{
  all.push_back(row);
  for (std::size_t c = 0; c < history_columns().size(); ++c)
    csv << (c > 0 ? "," : "") << history_columns()[c].value(row);
  csv << '\n';
  check_written(csv, directory + "/history.csv");
}

void History::flush() const
{
  Hdf5Writer file(directory + "/history.h5");
  std::string units;
  std::vector<double> values(all.size());
  for (const HistoryColumn &column : history_columns())
  {
    for (std::size_t r = 0; r < all.size(); ++r)
      values[r] = column.value(all[r]);
    file.table(column.name, values.data(), values.size());
    file.attribute("unit_" + column.name, column.unit);
  }
  file.close();
}
} // namespace kerf
