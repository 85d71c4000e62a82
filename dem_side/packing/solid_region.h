// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

#include <utility>

namespace kerf::dem
{
/// Corners of a box that the packing fills [m]: its own box, or for a packing of another shape the largest square (3D: cube) of
/// grid cells inside.
std::pair<Eigen::Vector3d, Eigen::Vector3d> filled_box(const Packing &packing);
} // namespace kerf::dem
