// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/energy_ledger.h"
#include "coupler/method/activation/virial_stress.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <cstdint>

namespace kerf
{
/// What both sides hold together, to audit a change of models.
struct ConservedQuantities
{
  double mass = 0.;                                           ///< [kg]
  Eigen::Vector3d momentum = Eigen::Vector3d::Zero();         ///< [N s]
  Eigen::Vector3d angular_momentum = Eigen::Vector3d::Zero(); ///< about the origin, with the particles' spin [N m s]
  double kinetic = 0., elastic = 0.;                          ///< [J]
  std::int64_t bonds = 0;                                     ///< of the particles, intact or broken
};
/// @param energies of the same moment. Collective.
ConservedQuantities conserved_quantities(const fem::FemSide &fem, dem::DemSide &dem, const EnergyLedger &energies,
                                         MPI_Comm comm);

/// What one change of models did: both models should behave alike (Labra et al., section on adaptive coupling).
struct ActivationEvent
{
  std::int64_t step = 0;
  double time = 0.;
  int cells = 0;                 ///< converted to particles; negative: given back to the finite elements
  int particles = 0;             ///< taken from the store; negative: put back
  std::int64_t bonds_stored = 0; ///< between these and any active particle; before and after must differ by them
  ConservedQuantities before, after;
  double held_before = 0., held_after = 0.; ///< energy of the model, see EnergyLedger::held() [J]
  double stress = 0.;                       ///< root mean square over the cells of the stress before [Pa]
  double stress_jump = 0.;                  ///< of the stress after less the stress before [Pa]
};

/// Enters the stress before and the jump to the stress after, one column for each cell.
void compare_stresses(ActivationEvent &event, const CellStresses &before, const CellStresses &after);
} // namespace kerf
