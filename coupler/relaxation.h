// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/case_file.h"
#include "dem_side/dem_side.h"

#include <functional>
#include <vector>

namespace kerf
{
/// Moves some particles to rest among frozen neighbours before time goes on. The projected field is smooth, but particles of a
/// random packing rest at places that fluctuate about it: let go, the excess of elastic energy would ring and overload bonds.
/// Velocities stay as projected, bonds do not break meanwhile. Heavy-ball iteration with the diagonal of the stiffness:
/// step 0.9, memory 0.55 converges for eigenvalues of D^-1 K up to 2 (0.9 x 2 < 2 (1 + 0.55)).
/// @param moving indices in the packing. @param compute_forces makes the forces for the present positions; called first.
/// @param springs stiffness of other springs on this rank's particles, for the present order [N/m]; empty: none. Collective.
void relax(const Case &settings, const dem::Packing &packing, const std::vector<int> &moving, dem::DemSide &dem_side,
           const std::function<void()> &compute_forces, const std::function<Eigen::VectorXd()> &springs);
} // namespace kerf
