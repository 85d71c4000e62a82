// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <random>

namespace kerf::test
{
/// @p n random places in a rectangle of 4 x 3 cells with edges @p h.
inline Eigen::Matrix3Xd scattered_points(int n, double h)
{
  std::mt19937 random(7);
  std::uniform_real_distribution<double> x(0., 4. * h), y(0., 3. * h);
  Eigen::Matrix3Xd points(3, n);
  for (int i = 0; i < n; ++i)
    points.col(i) = Eigen::Vector3d(x(random), y(random), 0.);
  return points;
}
} // namespace kerf::test
