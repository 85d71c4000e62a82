// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_parameters.h"
#include "dem_side/packing/packing.h"

#include <Eigen/Core>
#include <array>
#include <mpi.h>

namespace kerf::dem
{
struct Settings
{
  MPI_Comm comm = MPI_COMM_WORLD;
  const Packing *packing = nullptr; ///< the store, kept alive by the caller, the same on every rank
  BondParameters bond;
  double density = 0.;       ///< of a particle, see Packing::particle_density() [kg/m^3]
  double local_damping = 0.; ///< Cundall's non-viscous damping, F -= a |F| v/|v|, [0, 1)
  double time_step = 0.;     ///< [s]
  /// Particles that leave this box are removed and counted [m]. Along the periodic axes of the packing its box is the domain.
  Eigen::Vector3d domain_lower, domain_upper;
};

/// Throws std::invalid_argument that names every setting out of range.
void check_settings(const Settings &settings);

/// The box of the particle engine [m]: the box of the packing along periodic axes, a layer around z = 0 in 2D, else the domain
/// of the settings.
struct EngineBox
{
  Eigen::Vector3d lower, upper;
  std::array<char, 3> boundary; ///< in the engine's notation: 'p' periodic, 'f' particles leave there
};
EngineBox engine_box(const Settings &settings);
} // namespace kerf::dem
