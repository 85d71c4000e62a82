// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// A particle next to a part of the boundary, and the area of the boundary that it stands for.
struct TributaryArea
{
  int particle = -1;                                ///< index in the packing
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< outer
  double area = 0.;                                 ///< [m^2], 2D [m]
};

/// Particles that end at one of the chosen faces (flags by number in mesh.boundary): their gap to it is less than half a mean
/// radius larger than the smallest one, which is zero but for lattices that do not fit. By rising index, each with the first
/// face it is close to. None where the packing ends more than about a radius before the faces. The shares are in proportion to
/// the particles' sections and add up to the area of the faces.
std::vector<TributaryArea> tributary_areas(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing);
} // namespace kerf
