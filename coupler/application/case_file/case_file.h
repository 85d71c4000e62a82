// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/model_settings.h"
#include "dem_side/packing/packing.h"

#include <iosfwd>
#include <string>
#include <vector>

namespace kerf
{
Mode mode_from_name(const std::string &name);
std::string name_of(Mode mode);

/// Everything a case file says, in SI units: the model and the run.
struct Case : ModelSettings
{
  std::string directory;            ///< of case.prm; relative paths in it start here
  std::vector<std::string> notices; ///< old names that the case uses, a line each
  std::string name;
  Mode mode = Mode::adaptive; ///< unless the command line names another

  std::string packing_file;         ///< absolute
  std::string packing_surface_file; ///< absolute; empty: the packing fills the mesh
  dem::PackingSettings packing;

  bool calibrated_strength = false; ///< R_n, R_t are those of the store
  bool given_stiffness = false;     ///< bond.k_n, bond.k_t are not those of the store (specimens of a calibration)

  struct Calibration
  {
    int n_packings = 3;
    double specimen_width = 0.; ///< [m]
    double transits = 0.;       ///< of a P wave through the specimen during the loading
  } calibration;

  double energy_tolerance = 0.; ///< of the balance, share of the work done; 0: no bound

  double end_time = 0.;   ///< [s]
  double stop_below = 0.; ///< the run ends when the tool's force has fallen below this fraction of its peak; 0: never
  double time_step = 0.;  ///< [s]; 0: safety x stable step
  double safety = 0.;

  int history_interval = 0; ///< steps
  int n_snapshots = 0;

  int dim() const { return packing.dim; }
};

/// "Section/Key=value"
using Override = std::string;

/// Reads DIRECTORY/case.prm strictly. Throws InputError: file, section/key, what is wrong, what is allowed.
Case read_case(const std::string &directory, const std::vector<Override> &overrides);

/// All parameters of the case with the values used, as a case file that can be run again.
void write_used_parameters(const std::string &directory, const std::vector<Override> &overrides, std::ostream &out);

/// Reference of all parameters with unit, default, allowed values and meaning (Markdown).
void write_parameter_reference(std::ostream &out);
} // namespace kerf
