// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/region_distance.h"
#include "tests/support/dummy_fem_side.h"

#include <gtest/gtest.h>

#include <random>

using namespace kerf;
using Eigen::Vector3d;

namespace
{
/// Distance from an axis-parallel box, the closed answer.
double box_distance(const Vector3d &lower, const Vector3d &upper, const Vector3d &x)
{
  const Vector3d outside = (lower - x).cwiseMax(x - upper).cwiseMax(0.);
  return outside.norm();
}
} // namespace

// Closed answer for a block of converted cells; the distance is exact, so only round-off remains.
TEST(RegionDistance, ExactForABlock)
{
  const double h = 0.25;
  const test::DummyFemSide fem(12, 8, h, 1.);
  std::mt19937 random(3);
  std::uniform_real_distribution<double> x(0., 12. * h), y(0., 8. * h);
  Eigen::Matrix3Xd points(3, 2000);
  for (int i = 0; i < points.cols(); ++i)
    points.col(i) = Vector3d(x(random), y(random), 0.);
  const double reach = 3. * h;
  RegionDistance distance(fem.mesh(), points, reach);
  for (int j = 5; j < 8; ++j)
    for (int i = 3; i < 7; ++i)
      distance.add_cell(j * 12 + i);
  for (int i = 0; i < points.cols(); ++i)
  {
    const double exact = box_distance(Vector3d(3 * h, 5 * h, 0.), Vector3d(7 * h, 8 * h, 0.), points.col(i));
    EXPECT_NEAR(distance.values()[i], std::min(exact, reach), 1e-14);
  }
}
