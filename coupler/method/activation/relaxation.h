// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <functional>
#include <unordered_map>
#include <vector>

namespace kerf
{
/// Accelerations of the finite elements at the particles [m/s^2], by index in the packing; none: 0.
using Accelerations = std::unordered_map<int, Eigen::Vector3d>;

/// Moves some particles among frozen neighbours, before time goes on, to where their forces give them the acceleration that the
/// finite elements have there (in a static state: to rest). The projected field is smooth, but particles of a
/// random packing rest at places that fluctuate about it: let go, the excess of elastic energy would ring and overload bonds.
/// Velocities stay as projected, bonds do not break meanwhile. Heavy-ball iteration with the diagonal of the stiffness:
/// step 0.9, memory 0.55 converges for eigenvalues of D^-1 K up to 2 (0.9 x 2 < 2 (1 + 0.55)). Theory (7.12), (7.13).
/// @param density of the particles [kg/m^3]. @param moving indices in the packing. @param accelerations what they should have.
/// @param compute_forces makes the forces for the present positions again; those before the first move are there.
/// @param springs stiffness of other springs on this rank's particles, for the present order [N/m]; empty: none. Collective.
void relax(const dem::BondParameters &bond, double density, int iterations, const dem::Packing &packing,
           const std::vector<int> &moving, const Accelerations &accelerations, dem::DemSide &dem_side,
           const std::function<void()> &compute_forces, const std::function<Eigen::VectorXd()> &springs);
} // namespace kerf
