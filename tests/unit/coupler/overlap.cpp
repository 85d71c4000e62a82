// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/overlap/weight_function.h"
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

// A general convex quadrilateral against densely sampled distance: sampling step s gives an error below s.
TEST(RegionDistance, ConvexQuadrilateral)
{
  fem::Mesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0., 2., 0.3, 1.6, 0., 0.4, 1.1, 1.9, 0., 0., 0., 0.; // lexicographic corners
  mesh.cells.resize(4, 1);
  mesh.cells << 0, 1, 2, 3;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-1., 3.);
  for (int k = 0; k < 200; ++k)
  {
    const Vector3d x(coordinate(random), coordinate(random), 0.);
    double sampled = 1e300;
    constexpr int n = 400;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
      {
        const double s = double(i) / n, t = double(j) / n;
        const Vector3d point = (1 - s) * (1 - t) * mesh.nodes.col(0) + s * (1 - t) * mesh.nodes.col(1) +
                               (1 - s) * t * mesh.nodes.col(2) + s * t * mesh.nodes.col(3);
        sampled = std::min(sampled, (point - x).norm());
      }
    const double distance = distance_to_cell(mesh, 0, x);
    EXPECT_LE(distance, sampled + 1e-12);
    EXPECT_GE(distance, sampled - 2. * 2. / n);
  }
}

// Mass and stiffness are shared, never lost: both sides' weights at the same point sum to one, for every weight function.
// A sheared brick has plane faces; its distance is that of the nearest of many points on its surface, to their spacing squared
// over twice the distance, and the spacing where that is small. Inside it is zero.
TEST(RegionDistance, ConvexHexahedron)
{
  fem::Mesh mesh;
  mesh.dim = 3;
  mesh.nodes.resize(3, 8);
  mesh.cells.resize(8, 1);
  Eigen::Matrix3d shape;
  shape << 1., 0.3, -0.1, 0., 0.8, 0.2, 0.1, 0., 1.2;
  for (int a = 0; a < 8; ++a)
  {
    mesh.nodes.col(a) = shape * Vector3d(a & 1, (a >> 1) & 1, a >> 2);
    mesh.cells(a, 0) = a;
  }
  constexpr int n = 60;
  std::vector<Vector3d> surface;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
        {
          Vector3d x;
          x[axis] = side;
          x[(axis + 1) % 3] = double(i) / n;
          x[(axis + 2) % 3] = double(j) / n;
          surface.push_back(shape * x);
        }
  std::mt19937 random(9);
  std::uniform_real_distribution<double> coordinate(-0.7, 1.7);
  int n_inside = 0;
  for (int k = 0; k < 300; ++k)
  {
    const Vector3d natural(coordinate(random), coordinate(random), coordinate(random)), x = shape * natural;
    const double distance = distance_to_cell(mesh, 0, x);
    if ((natural.array() >= 0.).all() && (natural.array() <= 1.).all())
    {
      EXPECT_EQ(distance, 0.);
      ++n_inside;
      continue;
    }
    double sampled = 1e300;
    for (const Vector3d &point : surface)
      sampled = std::min(sampled, (point - x).norm());
    EXPECT_LE(distance, sampled + 1e-14);
    EXPECT_GE(distance, sampled - 1.3 / n);
    if (distance > 0.1)
      EXPECT_GE(distance, sampled - 1.3 * 1.3 / (n * n) / (2. * distance));
  }
  EXPECT_GT(n_inside, 5);
}

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
    Overlap overlap(fem.mesh(), points, packing, function, 2. * h);
    EXPECT_DOUBLE_EQ(overlap.fe_weights().minCoeff(), 1.);
    EXPECT_DOUBLE_EQ(overlap.de_weights().maxCoeff(), 0.);
    overlap.convert({5, 17, 40});
    overlap.convert({17, 18});
    EXPECT_EQ(overlap.n_converted(), 4);
    const Eigen::VectorXd sum = overlap.fe_weights() + overlap.de_weights();
    for (int i = 0; i < sum.size(); ++i)
    {
      EXPECT_DOUBLE_EQ(sum[i], 1.);
      EXPECT_EQ(overlap.needs_particle(i), overlap.de_weights()[i] > 0.);
    }
  }
}

TEST(Weight, ValuesAndEnds)
{
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::linear, 0.25, 1.), 0.25);
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::cubic, 0.25, 1.), 3. / 16. - 2. / 64.);
  EXPECT_DOUBLE_EQ(fe_weight(WeightFunction::constant, 0.25, 1.), 0.5);
  for (const WeightFunction function : {WeightFunction::linear, WeightFunction::cubic, WeightFunction::constant})
  {
    EXPECT_DOUBLE_EQ(fe_weight(function, 0., 1.), 0.);
    EXPECT_DOUBLE_EQ(fe_weight(function, 1., 1.), 1.);
  }
}
