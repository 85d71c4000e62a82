// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

namespace kerf::dem
{
/// Volumes [m^3] (2D: areas [m^2]) of the cells of the Laguerre (radical) tessellation, which assigns space to each particle by
/// planes of equal tangent length between neighbours (Imai, Iri & Murota 1985). A cell ends at 1.25 largest diameters from its
/// centre along each axis. Cells at a free surface are bounded by this limit only, so their volume has no meaning.
/// @param selected one entry for each particle: only cells with a nonzero entry are computed, the others get 0
Eigen::VectorXd laguerre_volumes(const Packing &packing, const std::vector<char> &selected);
} // namespace kerf::dem
