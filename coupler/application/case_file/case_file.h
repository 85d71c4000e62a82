// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/tool/tool_settings.h"
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

enum class WeightFunction
{
  linear,
  cubic,
  constant
};

enum class Criterion
{
  maximum_principal, ///< largest principal stress
  von_mises,
  mohr_coulomb,  ///< sigma_1 - sigma_3 f_t/f_c, equal to the tensile strength on the failure line
  drucker_prager ///< the cone through f_t and f_c, equal to the tensile strength on it
};

enum class ConstraintMethod
{
  penalty,             ///< constant k_DF, Labra et al., eq. (4)
  penalty_mass_scaled, ///< k_i = beta mu_i/dt^2
  multipliers,         ///< weak, on the finite-element nodes
  multipliers_diagonal ///< on the particles, lumped
};

/// Everything a case file says, in SI units.
struct Case
{
  std::string directory; ///< of case.prm; relative paths in it start here
  std::string name;
  Mode mode = Mode::adaptive; ///< unless the command line names another

  fem::Material rock;
  double tensile_strength = 0.;     ///< f_t [Pa], Mohr-Coulomb measure and target of the strength calibration
  double compressive_strength = 0.; ///< f_c [Pa], likewise

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

  ConstraintMethod constraint = ConstraintMethod::multipliers;
  WeightFunction weight_function = WeightFunction::linear;
  double overlap_width = 0.;          ///< [m]
  double penalty_ratio = 0.;          ///< beta (mass scaled), k_DF/k_n (constant) or kappa (diagonal multipliers)
  bool corrector = false;             ///< the penalties leave a packing its fluctuations
  double interface_damping = 0.;      ///< xi of the penalties
  double fluctuation_relaxation = 0.; ///< rho of the multipliers
  double energy_tolerance = 0.;       ///< of the balance, share of the work done; 0: no bound

  Criterion criterion = Criterion::mohr_coulomb;
  double sigma_star = 0.;      ///< [Pa]
  int check_interval = 0;      ///< steps
  int relaxation_steps = 0;    ///< of new particles before time goes on
  double event_fraction = 1.;  ///< of sigma*: an event also takes cells of the front whose stress is above this
  double return_fraction = 0.; ///< of sigma*: quieter particle cells become finite elements again; 0: never
  double return_time = 0.;     ///< for which they must have been [s]

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
