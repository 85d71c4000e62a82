// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/tool/tool_settings.h"
#include "coupler/method/activation/activation_settings.h"
#include "coupler/method/constraint/constraint_settings.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <iosfwd>
#include <string>
#include <utility>
#include <vector>

namespace kerf
{
/// Which models a run uses; all four read the same case file.
enum class Mode
{
  adaptive, ///< finite elements everywhere at first, particles where sigma > sigma*
  fixed,    ///< a predefined particle region
  dem,      ///< particles everywhere
  fem       ///< finite elements only
};
Mode mode_from_name(const std::string &name);
std::string name_of(Mode mode);

/// Everything a case file says, in SI units.
struct Case
{
  std::string directory; ///< of case.prm; relative paths in it start here
  std::string name;
  Mode mode = Mode::adaptive; ///< unless the command line names another

  fem::Material rock;

  fem::MeshSettings mesh;
  fem::Strain strain = fem::Strain::finite;
  fem::Integration integration = fem::Integration::full;
  std::vector<fem::BoundaryCondition> boundary_conditions;
  Eigen::Vector3d gravity = Eigen::Vector3d::Zero();        ///< [m/s^2]
  double gravity_ramp = 0.;                                 ///< [s]
  Eigen::Matrix3d initial_stress = Eigen::Matrix3d::Zero(); ///< Cauchy [Pa], tension positive

  std::string packing_file;         ///< absolute
  std::string packing_surface_file; ///< absolute; empty: the packing fills the mesh
  dem::PackingSettings packing;

  dem::BondParameters bond; ///< k_n, k_t are filled in from the calibrated store
  double local_damping = 0.;
  bool calibrated_strength = false; ///< R_n, R_t are those of the store
  bool given_stiffness = false;     ///< bond.k_n, bond.k_t are not those of the store (specimens of a calibration)

  struct Calibration
  {
    int n_packings = 3;
    double specimen_width = 0.; ///< [m]
    double transits = 0.;       ///< of a P wave through the specimen during the loading
  } calibration;

  OverlapSettings overlap;
  ConstraintSettings constraint;
  ActivationSettings activation;
  double energy_tolerance = 0.; ///< of the balance, share of the work done; 0: no bound

  std::vector<Box> fixed_region;

  ToolSettings tool;

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
