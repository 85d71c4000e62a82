// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>

/// Closest points of facets. The feature of the facet on which the point lies is 0 for its inside, 1 to 3 for the edge from
/// corner k to k + 1, 4 to 6 for corner k.
namespace kerf::dem
{
/// @p corner_a, @p corner_b, @p inside features to report for the ends of the segment and between them
inline Eigen::Vector3d closest_on_segment(const Eigen::Vector3d &a, const Eigen::Vector3d &b, const Eigen::Vector3d &x,
                                          int corner_a, int corner_b, int inside, int &feature)
{
  const Eigen::Vector3d along = b - a;
  const double s = along.dot(x - a) / along.squaredNorm();
  feature = s <= 0. ? corner_a : s >= 1. ? corner_b : inside;
  return a + std::clamp(s, 0., 1.) * along;
}

/// @param normal unit normal of the triangle, or zero for a triangle without area
inline Eigen::Vector3d closest_on_triangle(const std::array<Eigen::Vector3d, 3> &p, const Eigen::Vector3d &normal,
                                           const Eigen::Vector3d &x, int &feature)
{
  bool is_inside = normal.squaredNorm() > 0.5; // a triangle without area has edges only
  for (int k = 0; k < 3 && is_inside; ++k)
    is_inside = normal.cross(p[(k + 1) % 3] - p[k]).dot(x - p[k]) >= 0.;
  if (is_inside)
  {
    feature = 0;
    return x - normal * normal.dot(x - p[0]);
  }
  Eigen::Vector3d best;
  double best_square = 1e300;
  for (int k = 0; k < 3; ++k)
  {
    int found = 0;
    const Eigen::Vector3d on_edge = closest_on_segment(p[k], p[(k + 1) % 3], x, 4 + k, 4 + (k + 1) % 3, 1 + k, found);
    if (const double square = (x - on_edge).squaredNorm(); square < best_square)
    {
      best_square = square;
      best = on_edge;
      feature = found;
    }
  }
  return best;
}
} // namespace kerf::dem
