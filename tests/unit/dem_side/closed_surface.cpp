// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"
#include "dem_side/packing/laguerre.h"
#include "tests/support/test_surfaces.h"

#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <random>
#include <unistd.h>

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

std::string stl_error_of(const std::string &bytes)
{
  const std::string path = std::filesystem::temp_directory_path() / ("kerf_surface_" + std::to_string(getpid()) + ".stl");
  std::ofstream(path, std::ios::binary) << bytes;
  std::string text = "no error";
  try
  {
    read_stl(path);
  }
  catch (const std::invalid_argument &error)
  {
    text = error.what();
    EXPECT_EQ(text.substr(0, path.size() + 2), path + ": ");
    text = text.substr(path.size() + 2);
  }
  std::filesystem::remove(path);
  return text;
}
} // namespace

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

TEST(StlFile, BothFormatsGiveTheSurface)
{
  const SurfaceMesh mesh = test::sphere(2, 0.5, {1., 1., 1.});
  const std::string path = std::filesystem::temp_directory_path() / ("kerf_stl_" + std::to_string(getpid()) + ".stl");
  for (const bool binary : {false, true})
  {
    test::write_stl(mesh, path, binary);
    const SurfaceMesh read = read_stl(path);
    ASSERT_EQ(read.facets.size(), mesh.facets.size());
    // Single precision in the binary format: corners merge all the same.
    EXPECT_NEAR(ClosedSurface(3, read, 0.1).volume(), ClosedSurface(3, mesh, 0.1).volume(), 1e-6);
  }
  std::filesystem::remove(path);
}

TEST(StlFile, DamagedOnesAreNamed)
{
  EXPECT_EQ(stl_error_of("some text"), "is not an STL file");
  EXPECT_EQ(stl_error_of(""), "is not an STL file");
  EXPECT_EQ(stl_error_of("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n"), "vertex 1 does not have three numbers");
  EXPECT_EQ(stl_error_of("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"),
            "facet 1 does not have three vertices");
  try
  {
    read_stl("/nowhere/a.stl");
    FAIL() << "no error";
  }
  catch (const std::invalid_argument &error)
  {
    EXPECT_STREQ(error.what(), "/nowhere/a.stl: cannot be read");
  }
}

TEST(LaguerreCells, OfTwoSizesOnACubicLattice)
{
  // Radii a and b alternate: the plane to a nearest neighbour lies at s = (D^2 + a^2 - b^2) / (2 D) from a. Cells of the small
  // ones are cubes of edge 2 (D - s), the large ones share the rest of 2 D^3. Exact up to round-off.
  const double D = 1., a = 0.52, b = 0.4, s = (D * D + a * a - b * b) / (2. * D);
  const int n = 7;
  Packing packing;
  packing.dim = 3;
  packing.positions.resize(3, n * n * n);
  packing.radii.resize(n * n * n);
  std::vector<char> target(n * n * n, 0);
  for (int i = 0; i < n * n * n; ++i)
  {
    const int x = i % n, y = i / n % n, z = i / (n * n);
    packing.positions.col(i) << x, y, z;
    packing.radii[i] = (x + y + z) % 2 ? a : b;
    target[i] = std::min({x, y, z}) > 2 && std::max({x, y, z}) < n - 2;
  }
  const Eigen::VectorXd volumes = laguerre_volumes(packing, target);
  const double small = 8. * std::pow(D - s, 3);
  for (int i = 0; i < n * n * n; ++i)
    EXPECT_NEAR(volumes[i], !target[i] ? 0. : packing.radii[i] == b ? small : 2. * D * D * D - small, 1e-12);
}
