// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf::fem
{
/// Joins the sides of the mesh across periodic axes: fills Mesh::period, removes the faces of the joined sides from the
/// boundary and makes their cells neighbours. Throws std::invalid_argument with one line when the two sides do not match.
/// @return for every node the node of which it is the image, or the node itself
template <int dim>
std::vector<int> join_periodic_sides(const std::array<bool, 3> &axes, Mesh &mesh);
} // namespace kerf::fem
