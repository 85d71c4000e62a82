// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/fem_settings.h"
#include "coupler/method/coupled_model.h"
#include "tests/support/stable_steps_of.h"

#include <cmath>
#include <functional>

/// Coupled bodies without a tool, for tests.
namespace kerf::test
{
/// Rock of a triangular lattice of spacing @p d [m] whose constants are known (plane strain): k_n = E/(sqrt(3)(1+nu)(1-2nu)),
/// k_t/k_n = 1 - 4 nu. Nothing breaks or is activated; mesh, box, overlap and region are left to the test.
inline Case lattice_rock(double d)
{
  Case settings;
  settings.directory = "test";
  settings.rock.density = 2650.;
  settings.rock.young = 40e9;
  settings.rock.poisson = 0.2;
  settings.packing.kind = "triangular";
  settings.packing.mean_diameter = d;
  settings.bond.k_n = settings.rock.young / (std::sqrt(3.) * 1.2 * 0.6);
  settings.bond.k_t = 0.2 * settings.bond.k_n;
  settings.bond.R_n = settings.bond.R_t = 1e12;
  settings.constraint.method = "penalty_mass_scaled";
  settings.constraint.penalty_ratio = 0.25;
  settings.overlap.weight_function = WeightFunction::linear;
  settings.activation.criterion = Criterion::von_mises;
  settings.activation.sigma_star = 1e12;
  settings.activation.tensile_strength = settings.activation.compressive_strength = 1.;
  settings.tool.kind = ToolKind::none;
  settings.safety = 0.7;
  return settings;
}

/// Both sides of a case, not started.
struct Body
{
  explicit Body(const Case &the_case, Mode mode = Mode::fixed) : Body(the_case, dem::generate_packing(the_case.packing), mode)
  {
  }
  Body(const Case &the_case, const dem::Packing &store, Mode mode)
    : settings(the_case), packing(store), fem(make_fem(settings)),
      dt(0.7 * stable_steps_of(settings, mode, *fem, packing).coupled), model(settings, mode, *fem, packing, dt, MPI_COMM_WORLD)
  {
  }
  /// With a step of its own [s].
  Body(const Case &the_case, const dem::Packing &store, double step, Mode mode = Mode::fixed)
    : settings(the_case), packing(store), fem(make_fem(settings)), dt(step),
      model(settings, mode, *fem, packing, dt, MPI_COMM_WORLD)
  {
  }
  static std::unique_ptr<fem::FemSide> make_fem(const Case &settings)
  {
    return fem::make_fem_side(fem_settings(settings, MPI_COMM_WORLD));
  }
  void set_state(const std::function<Eigen::Vector3d(const Eigen::Vector3d &)> &u,
                 const std::function<Eigen::Vector3d(const Eigen::Vector3d &)> &v)
  {
    Eigen::Matrix3Xd displacement = fem->mesh().nodes, velocity = displacement;
    for (int a = 0; a < fem->mesh().n_nodes(); ++a)
    {
      displacement.col(a) = u(fem->mesh().nodes.col(a));
      velocity.col(a) = v(fem->mesh().nodes.col(a));
    }
    fem->set_state(displacement, velocity);
  }

  /// Displacements of the particles, by index in the packing; those that are not active rest.
  Eigen::Matrix3Xd particle_displacements()
  {
    Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, packing.size());
    const dem::Particles particles = model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
      u.col(particles.index[i]) = packing.displacement(particles.index[i], particles.position.col(i));
    MPI_Allreduce(MPI_IN_PLACE, u.data(), static_cast<int>(u.size()), MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return u;
  }

  Case settings;
  dem::Packing packing;
  std::unique_ptr<fem::FemSide> fem;
  double dt;
  CoupledModel model;
};
} // namespace kerf::test
