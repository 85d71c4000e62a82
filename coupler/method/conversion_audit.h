// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/energy_ledger.h"
#include "coupler/method/activation/virial_stress.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <cstdint>

namespace kerf
{
/// Conserved quantities of both sides together, for the audit of a conversion.
struct ConservedQuantities
{
  double mass = 0.;                                           ///< [kg]
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();         ///< [N s]
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero(); ///< about the origin, including the spin of the particles [N m s]
  double kinetic = 0., elastic = 0.;                          ///< [J]
  std::int64_t bonds = 0;                                     ///< intact and broken bonds of the particles
};
/// @param energies of the model at the same time. Collective.
ConservedQuantities conserved_quantities(const fem::FemSide &fem, dem::DemSide &dem, const EnergyLedger &energies,
                                         MPI_Comm comm);

/// Audit of one conversion. Both models should behave alike (Labra et al., section on adaptive coupling).
struct ActivationEvent
{
  std::int64_t step = 0;
  double time = 0.;
  Eigen::Vector3d place = Eigen::Vector3d::Zero(); ///< mean of the centres of the cells [m]
  int cells = 0;                      ///< number of cells converted to particles; negative: returned to the continuum
  int particles = 0;                  ///< number of particles inserted; negative: removed
  std::int64_t bonds_stored = 0;      ///< number of stored bonds to active particles that this creates; negative: removes
  std::int64_t bonds_born_broken = 0; ///< of them, not created since a particle has left the field, see broken_at_birth()
  ConservedQuantities before, after;
  double held_before = 0., held_after = 0.; ///< energy held by the model and by particles that left it, see EnergyLedger [J]
  double stress = 0.;                       ///< root mean square of the stress before, over the cells [Pa]
  double stress_jump = 0.;                  ///< root mean square of the difference between the stresses after and before [Pa]
};

/// Computes stress and stress_jump of @p event. Each column of @p before and @p after is the stress of one cell.
void compare_stresses(ActivationEvent &event, const CellStresses &before, const CellStresses &after);
} // namespace kerf
