// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/conversion_log.h"

#include "coupler/application/output/written.h"

#include <iomanip>

namespace kerf
{
namespace
{
struct Column
{
  const char *name, *unit;
  bool in_space; ///< in three dimensions only
  double (*value)(const ConservedQuantities &);
};

using What = const ConservedQuantities &;
const Column columns[] = {{"mass", "kg", false, [](What w) { return w.mass; }},
                          {"momentum_x", "N s", false, [](What w) { return w.momentum[0]; }},
                          {"momentum_y", "N s", false, [](What w) { return w.momentum[1]; }},
                          {"momentum_z", "N s", true, [](What w) { return w.momentum[2]; }},
                          {"angular_momentum_x", "N m s", true, [](What w) { return w.angular_momentum[0]; }},
                          {"angular_momentum_y", "N m s", true, [](What w) { return w.angular_momentum[1]; }},
                          {"angular_momentum_z", "N m s", false, [](What w) { return w.angular_momentum[2]; }},
                          {"energy_kinetic", "J", false, [](What w) { return w.kinetic; }},
                          {"energy_elastic", "J", false, [](What w) { return w.elastic; }}};
} // namespace

ConversionLog::ConversionLog(const std::string &directory, bool plane)
  : plane(plane), path(directory + "/activations.csv"), csv(path)
{
  csv << "# units: time [s]";
  for (const Column &column : columns)
    if (!column.in_space || !plane)
      csv << "; " << column.name << " [" << column.unit << "]";
  csv << "; bonds_created: by the conversion, broken ones included, bonds_stored: number of stored bonds of its particles, "
         "bonds_born_broken: of them, broken from the start\n"
      << "# negative cells and particles: returned to the continuum; stress and stress_jump [Pa]: root mean square "
         "over "
         "the cells before, and of the difference\n"
      << "step,time,cells,particles,bonds_created,bonds_stored,bonds_born_broken,stress,stress_jump";
  for (const Column &column : columns)
    if (!column.in_space || !plane)
      csv << ',' << column.name << "_before," << column.name << "_after";
  csv << '\n' << std::setprecision(12);
  check_written(csv, path);
}

void ConversionLog::add(const ActivationEvent &event)
{
  csv << event.step << ',' << event.time << ',' << event.cells << ',' << event.particles << ','
      << event.after.bonds - event.before.bonds << ',' << event.bonds_stored << ',' << event.bonds_born_broken << ','
      << event.stress << ',' << event.stress_jump;
  for (const Column &column : columns)
    if (!column.in_space || !plane)
      csv << ',' << column.value(event.before) << ',' << column.value(event.after);
  csv << '\n';
  check_written(csv, path);
}
} // namespace kerf
