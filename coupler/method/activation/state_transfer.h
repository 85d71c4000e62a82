// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <functional>
#include <unordered_map>
#include <vector>

namespace kerf
{
/// The stored particles that the overlap needs and that were not inserted before, see @p taken. They have the kinematics of the
/// finite elements at their positions: u = N u_F, v = N v_F, theta = 1/2 curl u_F, omega = 1/2 curl v_F. The list is the same
/// on every rank. Throws std::logic_error when a particle lies outside the mesh. Collective. Replaces the nodal window of the
/// finite elements. Theory (7.10).
std::vector<dem::NewParticle> project(fem::FemSide &fem, const Overlap &overlap, const dem::Packing &packing,
                                      const std::vector<char> &taken, MPI_Comm comm);

/// The same for stored particles @p indices, ascending.
std::vector<dem::NewParticle> states_by_field(fem::FemSide &fem, const dem::Packing &packing, const std::vector<int> &indices,
                                              MPI_Comm comm);

/// Stored bonds between new @p particles and active ones that must not be created, the same list on every rank. An active
/// partner may have come off the rock. It then is not where the finite elements expect it, and the bond would be born with
/// energy that nothing has put in. The field is that before the weights change. Collective. Replaces the nodal window of the
/// finite elements. Theory (7.20).
std::vector<dem::StoredPair> broken_at_birth(const std::vector<dem::NewParticle> &particles, fem::FemSide &fem,
                                             const dem::DemSide &dem, const dem::Packing &packing,
                                             const dem::StoredBonds &bonds, MPI_Comm comm);

/// Active particles whose weighted mass grows when @p added particles and the weights of @p overlap come into force take the
/// new mass from the finite elements, with the velocity that it has there. A particle in the overlap moves with them anyway.
/// One that has come off the rock does not, and would bring in energy if its mass grew at a velocity of its own. To be called
/// before the weights change. Collective. Replaces the nodal window of the finite elements.
/// @param is_held whether a boundary prescribes the velocity of a particle, by index in the packing, along an axis
/// Theory (7.23)
void take_momentum_of_growth(const std::vector<dem::NewParticle> &added, const std::function<bool(int, int)> &is_held,
                             fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const Overlap &overlap,
                             MPI_Comm comm);

/// Accelerations f/m of the finite elements at stored particles, at the end of the last step [m/s^2], by index in the packing,
/// the same on every rank. Collective. Replaces the nodal window of the finite elements.
std::unordered_map<int, Eigen::Vector3d> project_accelerations(fem::FemSide &fem, const dem::Packing &packing,
                                                               const std::vector<int> &indices, MPI_Comm comm);

/// Displacements [m] and velocities [m/s] of all nodes.
struct NodalState
{
  Eigen::Matrix3Xd displacement, velocity;
};

/// The nodal state after @p cells have returned to the continuum. Nodes that had no mass are fitted to the particles in the
/// cells by mass-weighted least squares of displacement and velocity. Nodes that had mass keep their state, and so do
/// components that a boundary condition holds (inverse mass zero). The finite elements must already have the new weights.
/// @param mass_before nodal masses before the return [kg]. Collective.
NodalState recover_nodes(const fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const std::vector<int> &cells,
                         const Eigen::Matrix3Xd &mass_before, MPI_Comm comm);
} // namespace kerf
