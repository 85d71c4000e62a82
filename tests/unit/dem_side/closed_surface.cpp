// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"
#include "tests/support/test_surfaces.h"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>

using namespace kerf::dem;
using Eigen::Vector3d;

namespace
{
std::string error_of(int dim, const SurfaceMesh &mesh)
{
  try
  {
    ClosedSurface(dim, mesh, 0.1);
  }
  catch (const std::invalid_argument &error)
  {
    return error.what();
  }
  return "no error";
}
} // namespace

TEST(ClosedSurface, CrossSections)
{
  const ClosedSurface flat(2, test::l_shape(2.), 0.5), prism(3, test::l_prism(2., 0.7), 0.5);
  EXPECT_NEAR(flat.section(0.3), 2., 1e-14);
  EXPECT_NEAR(flat.section(1.5), 1., 1e-14);
  EXPECT_NEAR(prism.section(0.3), 2. * 0.7, 1e-14);
  EXPECT_NEAR(prism.section(1.5), 1. * 0.7, 1e-14);
  EXPECT_EQ(prism.section(2.5), 0.);
  // A circle; the polygon of the facets, whose edges are 0.05, is smaller by some 1e-4.
  const ClosedSurface ball(3, test::sphere(4, 2., {1., 5., -3.}), 0.5);
  EXPECT_NEAR(ball.section(6.), std::acos(-1.) * 3., 2e-2);
}

TEST(ClosedSurface, MomentsAreThoseOfTheBody)
{
  // The L shape is symmetric about its diagonal. Mean of u.x over it, from its three squares: by the centre (5/6, 5/6) of area,
  // relative to the middle (1, 1) and the half width 1. Mean of (u.x)^2 from centres and squares' own moments 1/12.
  const ClosedSurface shape(2, test::l_shape(2.), 0.5);
  const std::vector<double> moments = shape.moments();
  ASSERT_EQ(moments.size(), 35u);
  const double u = 0.61, v = 0.28;
  EXPECT_NEAR(moments[0], -(u + v) / 6., 1e-14);
  double second = 0.;
  for (const auto &[x, y] : {std::pair(-0.5, -0.5), {0.5, -0.5}, {-0.5, 0.5}})
    second += (std::pow(u * x + v * y, 2) + (u * u + v * v) / 12.) / 3.;
  EXPECT_NEAR(moments[1], second, 1e-14);

  const SurfaceMesh l_prism = test::l_prism(2., 1.);
  const auto difference = [](const std::vector<double> &a, const std::vector<double> &b)
  {
    double largest = 0.;
    for (std::size_t k = 0; k < a.size(); ++k)
      largest = std::max(largest, std::abs(a[k] - b[k]));
    return largest;
  };
  // The prism of the L: other facets and place, same numbers; its mirror image about x: others.
  const std::vector<double> prism = ClosedSurface(3, l_prism, 0.5).moments();
  SurfaceMesh moved = l_prism;
  std::reverse(moved.facets.begin(), moved.facets.end());
  moved.points.colwise() += Vector3d(1000., -500., 200.); // round-off 1e-13 of the coordinates
  EXPECT_LT(difference(ClosedSurface(3, moved, 0.5).moments(), prism), 1e-10);
  SurfaceMesh mirrored = l_prism;
  mirrored.points.row(0) *= -1.;
  EXPECT_GT(difference(ClosedSurface(3, mirrored, 0.5).moments(), prism), 1e-2);

  // More points on the same sides.
  SurfaceMesh finer;
  const SurfaceMesh coarse = test::l_shape(2.);
  finer.points.resize(3, 12);
  for (int k = 0; k < 6; ++k)
  {
    finer.points.col(2 * k) = coarse.points.col(k);
    finer.points.col(2 * k + 1) = 0.7 * coarse.points.col(k) + 0.3 * coarse.points.col((k + 1) % 6);
    finer.facets.push_back({{2 * k, 2 * k + 1, -1}});
    finer.facets.push_back({{2 * k + 1, (2 * k + 2) % 12, -1}});
  }
  EXPECT_LT(difference(ClosedSurface(2, finer, 0.5).moments(), moments), 1e-13);
}

TEST(ClosedSurface, LShapeKnowsDistancesAndInside)
{
  // Exact numbers up to round-off.
  const ClosedSurface surface(2, test::l_shape(2.), 0.5);
  EXPECT_NEAR(surface.volume(), 3., 1e-12);
  EXPECT_NEAR(surface.area(), 8., 1e-12);
  EXPECT_TRUE(surface.contains({0.5, 1.5, 0.}));
  EXPECT_TRUE(surface.contains({1.5, 0.5, 0.}));
  EXPECT_FALSE(surface.contains({1.5, 1.5, 0.}));
  EXPECT_FALSE(surface.contains({-0.1, 1., 0.}));

  // Near the outer corner there are two walls; near the reentrant one a single foot on its point.
  const auto corner = surface.feet({0.1, 0.2, 0.}, 0.5);
  ASSERT_EQ(corner.size(), 2u);
  EXPECT_NEAR(corner[0].distance, 0.1, 1e-12);
  EXPECT_LE((corner[0].inward - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_NEAR(corner[1].distance, 0.2, 1e-12);
  EXPECT_LE((corner[1].inward - Vector3d::UnitY()).norm(), 1e-12);
  const auto reentrant = surface.feet({0.7, 0.6, 0.}, 0.6);
  ASSERT_EQ(reentrant.size(), 1u);
  EXPECT_NEAR(reentrant[0].distance, 0.5, 1e-12);
  EXPECT_LE((reentrant[0].inward - Vector3d(-0.6, -0.8, 0.)).norm(), 1e-12);
  // Outside distances are negative and lead back.
  const auto outside = surface.feet({1.3, 1.1, 0.}, 0.2);
  ASSERT_EQ(outside.size(), 1u);
  EXPECT_NEAR(outside[0].distance, -0.1, 1e-12);
  EXPECT_LE((outside[0].inward + Vector3d::UnitY()).norm(), 1e-12);
  EXPECT_TRUE(surface.feet({0.5, 0.5, 0.}, 0.4).empty());
}

TEST(ClosedSurface, AgreesWithTheSphereItApproximates)
{
  // 5120 triangles: planes lie at most 1 - cos(half an edge angle) = 2e-3 radii inside of the sphere.
  const double radius = 2.;
  SurfaceMesh mesh = test::sphere(4, radius, {1., 2., 3.});
  for (std::size_t f = 0; f < mesh.facets.size(); f += 3) // the direction of facets in a file must not matter
    std::swap(mesh.facets[f][0], mesh.facets[f][1]);
  const ClosedSurface surface(3, mesh, 0.3);
  const double pi = std::acos(-1.);
  EXPECT_NEAR(surface.volume() / (4. / 3. * pi * 8.), 1., 6e-3);
  EXPECT_NEAR(surface.area() / (16. * pi), 1., 4e-3);
  std::mt19937_64 random(3);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-52 - 1.; };
  int near = 0;
  for (int k = 0; k < 2000; ++k)
  {
    const Vector3d arm = 2.3 * Vector3d(uniform(), uniform(), uniform());
    const Vector3d x = Vector3d(1., 2., 3.) + arm;
    const double exact = radius - arm.norm();
    if (std::abs(exact) > 5e-3)
    {
      EXPECT_EQ(surface.contains(x), exact > 0.);
    }
    if (std::abs(exact) > 0.29)
      continue;
    const auto &feet = surface.feet(x, 0.3);
    ASSERT_FALSE(feet.empty());
    EXPECT_NEAR(feet[0].distance, exact, 5e-3);
    EXPECT_GT(feet[0].inward.dot(-arm.normalized()), 0.99);
    ++near;
  }
  EXPECT_GT(near, 100);
}

TEST(ClosedSurface, WhatIsNotClosedIsNamed)
{
  EXPECT_EQ(error_of(3, SurfaceMesh()), "closed surface: has no facets");
  SurfaceMesh open = test::sphere(1, 1., Vector3d::Zero());
  open.facets.pop_back();
  EXPECT_EQ(error_of(3, open).substr(0, 74), "closed surface: is not closed, 3 edges belong to one facet only, the first");
  SurfaceMesh twice = test::l_shape(1.);
  twice.facets.push_back({{0, 3, -1}});
  EXPECT_EQ(error_of(2, twice).substr(0, 85),
            "closed surface: touches itself, 2 points belong to more than two facets, the first at");
}
