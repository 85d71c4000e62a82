// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/near_cell.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Half width of the contact of a rigid cylinder with an elastic half space at the largest pressure @p pressure [Pa] (Hertz;
/// Johnson 1985, sec. 4.2c) [m]; infinite for an infinite @p radius [m]. Theory (7.21).
double contact_half_width(double radius, double pressure, const fem::Material &rock);

/// Cells that cannot resolve the contact which they are about to have: half of its width covers less than two cells when the
/// contact pressure reaches the compressive strength. Theory (7.22). Each once, ascending.
std::vector<int> cells_too_coarse_for_contact(const std::vector<NearCell> &near, double compressive_strength,
                                              const fem::Material &rock, const fem::Mesh &mesh);
} // namespace kerf
