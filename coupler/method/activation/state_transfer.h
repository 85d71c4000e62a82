// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <unordered_map>
#include <vector>

namespace kerf
{
/// Stored particles that the overlap needs and that are not @p taken yet, with the kinematics of the finite elements at their
/// place: u = N u_F, v = N v_F, theta = 1/2 curl u_F, omega = 1/2 curl v_F. Same list on every rank. Collective; replaces the
/// window of the finite elements. Theory (7.10).
std::vector<dem::NewParticle> project(fem::FemSide &fem, const Overlap &overlap, const dem::Packing &packing,
                                      const std::vector<char> &taken, MPI_Comm comm);

/// Accelerations of the finite elements at the places of stored particles, f/m of the step that has ended [m/s^2], by index in
/// the packing, the same on every rank. Collective; replaces the window of the finite elements.
std::unordered_map<int, Eigen::Vector3d> project_accelerations(fem::FemSide &fem, const dem::Packing &packing,
                                                               const std::vector<int> &indices, MPI_Comm comm);

/// Displacements [m] and velocities [m/s] of all nodes.
struct NodalState
{
  Eigen::Matrix3Xd displacement, velocity;
};

/// The state of the finite elements with nodes that had no mass filled in from the particles in @p cells: mass-weighted least
/// squares of the particles' displacements and velocities about their interpolation. Nodes that moved with the finite elements
/// so far, and components that a boundary holds (no inverse mass), keep what they have. Collective; the finite elements already
/// have the weights with which the nodes move again. @param moved mass of the nodes before that [kg]
NodalState recover_nodes(const fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const std::vector<int> &cells,
                         const Eigen::Matrix3Xd &moved, MPI_Comm comm);
} // namespace kerf
