// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <functional>
#include <unordered_map>
#include <vector>

namespace kerf
{
/// Accelerations of the finite elements at the particles [m/s^2], by index in the packing. A missing index means zero.
using Accelerations = std::unordered_map<int, Eigen::Vector3d>;

/// Relaxes particles at constant time. Each moving particle is displaced until its forces produce the acceleration of the
/// finite elements at its place; in a static state this is equilibrium. All other particles are fixed. The projected field is
/// smooth, but the equilibrium positions of a random packing fluctuate about it. Without relaxation the excess of elastic
/// energy would cause oscillations and overload bonds. Velocities stay as projected and bonds do not break. The iteration is
/// the heavy-ball method with the diagonal D of the stiffness. Step 0.9 and memory 0.55 converge for eigenvalues of D^-1 K up
/// to 2, since 0.9 x 2 < 2 (1 + 0.55). Theory (7.12), (7.13).
/// @param density of the particles [kg/m^3]. @param moving indices in the packing. @param accelerations target accelerations.
/// @param compute_forces recomputes the forces at the present positions. The caller has computed them for the start.
/// @param springs stiffness of further springs on this rank's particles, in their present order [N/m]; empty: none. Collective.
void relax(const dem::BondParameters &bond, double density, int iterations, const dem::Packing &packing,
           const std::vector<int> &moving, const Accelerations &accelerations, dem::DemSide &dem_side,
           const std::function<void()> &compute_forces, const std::function<Eigen::VectorXd()> &springs);
} // namespace kerf
