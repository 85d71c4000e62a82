// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/energy_ledger.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <unordered_map>
#include <vector>

namespace kerf
{
/// Chooses the cells that become particles (Labra et al., eq. (5)): sigma > sigma*, the front advancing by at most half an
/// overlap width an event, and no cell left behind that is enclosed by particle region.
class ActivationRule
{
public:
  ActivationRule(const Case &settings, const fem::Mesh &mesh, MPI_Comm comm);

  /// Cells to convert now, sorted, the same list on every rank. Collective.
  std::vector<int> cells_to_convert(const fem::FemSide &fem, const Overlap &overlap) const;

  /// Stress measure of every mesh cell [Pa] (0 where there are no finite elements), the same on every rank. Collective.
  Eigen::VectorXd measures(const fem::FemSide &fem) const;

private:
  const Case &settings;
  const fem::Mesh &mesh;
  MPI_Comm comm;
};

/// Adds cells to a region, one flag for each cell, until none outside has at most one neighbour outside: each could enclose the
/// next. Returns the cells that came in.
std::vector<int> enclose(const fem::Mesh &mesh, std::vector<char> &region);

/// Stored particles that the overlap needs and that are not @p taken yet, with the kinematics of the finite elements at their
/// place: u = N u_F, v = N v_F, theta = 1/2 curl u_F, omega = 1/2 curl v_F. Same list on every rank. Collective; replaces the
/// window of the finite elements.
std::vector<dem::NewParticle> project(fem::FemSide &fem, const Overlap &overlap, const dem::Packing &packing,
                                      const std::vector<char> &taken, MPI_Comm comm);

/// Accelerations of the finite elements at the places of stored particles, f/m of the step that has ended [m/s^2], by index in
/// the packing, the same on every rank. Collective; replaces the window of the finite elements.
std::unordered_map<int, Eigen::Vector3d> project_accelerations(fem::FemSide &fem, const dem::Packing &packing,
                                                               const std::vector<int> &indices, MPI_Comm comm);

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
} // namespace kerf
