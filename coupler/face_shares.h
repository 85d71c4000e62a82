// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// A particle next to a part of the boundary, and the area of the boundary that it stands for.
struct FaceShare
{
  int particle = -1;                                ///< index in the packing
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(); ///< outer
  double area = 0.;                                 ///< [m^2], 2D [m]
};

/// Particles whose surface is closer than half a mean radius to one of the chosen faces (flags by number in mesh.boundary), by
/// rising index, each with the first face it is close to. The shares are in proportion to the particles' sections and add up to
/// the area of the faces.
std::vector<FaceShare> face_shares(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing);
} // namespace kerf
