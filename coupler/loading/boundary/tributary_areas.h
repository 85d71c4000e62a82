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

/// Particles that end at one of the chosen faces, by rising index. A particle ends at a face when its gap to the face exceeds
/// the smallest gap by less than half a mean radius; the smallest gap is zero but for lattices that do not fit. A particle at
/// several faces counts for the first one. There are none where the packing ends more than about a radius before the faces. The
/// areas are in proportion to the particles' sections and add up to the area of the faces. Theory (9.14).
/// @param faces one flag for each face of mesh.boundary
std::vector<TributaryArea> tributary_areas(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing);
} // namespace kerf
