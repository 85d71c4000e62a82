// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

namespace kerf::dem
{
/// Volumes [m^3] (2D: areas [m^2]) of the cells of the Laguerre (radical) tessellation, the space that belongs to each
/// particle: planes of equal tangent length between neighbours (Imai, Iri & Murota 1985). A cell ends at 1.25 largest diameters
/// from its centre along each axis, so those at a free surface are bounded but mean nothing.
/// @param target only particles with a nonzero entry are computed, the others get 0; one entry for each particle
Eigen::VectorXd laguerre_volumes(const Packing &packing, const std::vector<char> &target);
} // namespace kerf::dem
