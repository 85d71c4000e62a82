// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/strengths.h"
#include "coupler/method/model_settings.h"
#include "dem_side/packing/packing.h"

#include <iosfwd>
#include <string>
#include <vector>

namespace kerf
{
Mode mode_from_name(const std::string &name);
std::string name_of(Mode mode);

/// The contents of a case file in SI units: settings of the model and of the run.
struct Case : ModelSettings
{
  bool force = false;               ///< goes on when the estimated memory exceeds that of the machine
  std::string directory;            ///< directory of case.prm; relative paths start here
  std::vector<std::string> notices; ///< one line for each old name in the case file
  std::string used_parameters;      ///< all parameters with the values used, as a case file that can be run again
  std::string name;
  Mode mode = Mode::adaptive; ///< the command line can override it

  double overlap_cells = 0.; ///< width of the overlap in cells; 0: it is given in diameters

  std::string packing_file;         ///< absolute
  std::string packing_surface_file; ///< absolute; empty: the packing fills the mesh
  dem::PackingSettings packing;

  std::string strength_summary; ///< lines on the strengths of bonds and rock and on sigma*, with their source
  bool given_stiffness = false; ///< use bond.k_n, bond.k_t instead of those of the store, for specimens of a calibration

  struct Calibration
  {
    int n_packings = 3;
    double specimen_width = 0.; ///< [m]
    double transits = 0.;       ///< duration of the loading in times that a P wave takes through the specimen [-]
  } calibration;

  double energy_tolerance = 0.; ///< largest error of the energy balance, fraction of the energy put in [-]; 0: all of it

  double end_time = 0.;   ///< [s]
  double stop_below = 0.; ///< fraction of the peak of the tool force below which the run ends [-]; 0: never
  double time_step = 0.;  ///< [s]; 0: safety x stable step
  double safety = 0.;

  int history_interval = 0; ///< steps
  int n_snapshots = 0;

  int dim() const { return packing.dim; }
};

/// "Section/Key=value"
using Override = std::string;

/// Reads DIRECTORY/case.prm. Unknown keys are errors. Throws InputError with file, section/key, the error and the allowed
/// values.
Case read_case(const std::string &directory, const std::vector<Override> &overrides);
/// The section Tool alone, for scripts of an exported case: the files that the case names need not be there. Throws InputError.
ToolSettings read_tool_of_case(const std::string &directory);

/// The kind of packing, rock and bonds of a case, without results.
Strengths strengths_wanted(const Case &settings);

/// Writes the reference of all parameters with unit, default, allowed values and meaning, in Markdown.
void write_parameter_reference(std::ostream &out);
} // namespace kerf
