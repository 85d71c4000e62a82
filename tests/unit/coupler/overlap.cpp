// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/overlap.h"
#include "tests/support/dummy_fem_side.h"

#include <gtest/gtest.h>

#include <random>

using namespace kerf;
using Eigen::Vector3d;

// Mass and stiffness are shared, never lost: both sides' weights at the same point sum to one, for every weight function.
TEST(Overlap, WeightsSumToOne)
{
  const double h = 0.25;
  const test::DummyFemSide fem(12, 8, h, 1.);
  std::mt19937 random(11);
  std::uniform_real_distribution<double> x(0., 12. * h), y(0., 8. * h);
  Eigen::Matrix3Xd points(3, 500);
  for (int i = 0; i < points.cols(); ++i)
    points.col(i) = Vector3d(x(random), y(random), 0.);
  for (const WeightFunction function : {WeightFunction::linear, WeightFunction::cubic, WeightFunction::constant})
  {
    dem::Packing packing;
    packing.positions = points;
    packing.radii = Eigen::VectorXd::Constant(points.cols(), 0.1 * h);
    packing.mean_diameter = 0.2 * h;
    Overlap overlap(fem.mesh(), points, points, packing, function, 2. * h);
    EXPECT_DOUBLE_EQ(overlap.fe_weights().minCoeff(), 1.);
    EXPECT_DOUBLE_EQ(overlap.de_weights().maxCoeff(), 0.);
    overlap.convert({5, 17, 40});
    overlap.convert({17, 18});
    EXPECT_EQ(overlap.n_converted(), 4);
    const Eigen::VectorXd sum = overlap.fe_weights() + overlap.de_weights();
    EXPECT_EQ(overlap.fe_surface_weights(), overlap.fe_weights());
    for (int i = 0; i < sum.size(); ++i)
    {
      EXPECT_DOUBLE_EQ(sum[i], 1.);
      EXPECT_EQ(overlap.needs_particle(i), overlap.de_weights()[i] > 0.);
    }
  }
}
