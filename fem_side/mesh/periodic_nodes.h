// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf::fem
{
/// Makes the mesh repeat itself across the axes: fills Mesh::period, takes the faces of the joined sides off the boundary and
/// makes their cells neighbours. Throws std::runtime_error with one line when the two sides do not match.
/// @return of every node the one that it is an image of, itself if none
template <int dim>
std::vector<int> join_periodic_sides(const std::array<bool, 3> &axes, Mesh &mesh);
} // namespace kerf::fem
