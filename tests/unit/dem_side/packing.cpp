// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"
#include "dem_side/geometry/cell_list.h"
#include "tests/support/packing_checks.h"

#include <gtest/gtest.h>
#include <limits>
#include <random>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
PackingSettings triangular(double width, double height)
{
  PackingSettings settings;
  settings.kind = "triangular";
  settings.mean_diameter = 2e-3;
  settings.lower = {-1e-2, 5e-3, 0.};
  settings.upper = settings.lower + Eigen::Vector3d(width, height, 0.) * settings.mean_diameter;
  return settings;
}

Packing from_points(std::vector<Eigen::Vector3d> points, double radius)
{
  Packing packing;
  packing.positions.resize(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    packing.positions.col(i) = points[i];
  packing.radii.setConstant(points.size(), radius);
  return packing;
}

} // namespace

TEST(TriangularPacking, FillsTheBoxWithCentredRows)
{
  // 10.2 x 9 diameters: rows of 10 and 9 discs; 1 + 9 sqrt(3)/2 = 8.79 diameters hold 10 rows.
  const Packing packing = generate_packing(triangular(10.2, 9.));
  ASSERT_EQ(packing.size(), 5 * 10 + 5 * 9);
  const double d = packing.mean_diameter;
  const Eigen::Vector3d low = packing.positions.rowwise().minCoeff(), high = packing.positions.rowwise().maxCoeff();
  // Exact numbers up to round-off of the positions.
  EXPECT_NEAR(low[0] - packing.lower[0], 0.6 * d, 1e-12 * d);
  EXPECT_NEAR(packing.upper[0] - high[0], 0.6 * d, 1e-12 * d);
  EXPECT_NEAR(low[1] - packing.lower[1], packing.upper[1] - high[1], 1e-12 * d);
  EXPECT_NEAR(high[1] - low[1], 9. * std::sqrt(3.) / 2. * d, 1e-12 * d);

  // 10 in each row when the shifted row fits as well: 10.5 diameters, made with round-off against us.
  EXPECT_EQ(generate_packing(triangular(10.5, 9.)).size(), 100);
}

TEST(TriangularPacking, BondsNearestNeighboursOnlyAtAnyTolerance)
{
  for (const double tolerance : {0., 0.1, 2.}) // second neighbours are 1.46 radii apart
  {
    PackingSettings settings = triangular(20.5, 20.);
    settings.gap_tolerance = tolerance;
    const Packing packing = generate_packing(settings);
    std::vector<int> partners(packing.size(), 0);
    for (const auto &[i, j] : packing.bonds)
    {
      EXPECT_NEAR((packing.positions.col(i) - packing.positions.col(j)).norm(), packing.mean_diameter, 1e-10);
      ++partners[i];
      ++partners[j];
    }
    for (int i = 0; i < packing.size(); ++i)
    {
      const Eigen::Vector3d x = packing.positions.col(i);
      const double inside =
        std::min((x - packing.lower).head<2>().minCoeff(), (packing.upper - x).head<2>().minCoeff()) / packing.mean_diameter;
      EXPECT_GE(partners[i], 2);
      if (inside > 1.5)
      {
        EXPECT_EQ(partners[i], 6);
      }
    }
  }
}

TEST(Bonds, EqualBruteForce)
{
  std::mt19937_64 random(7);
  const auto uniform = [&] { return double(random() >> 11) * 0x1p-53; };
  for (const int dim : {2, 3})
  {
    Packing packing;
    packing.dim = dim;
    const int n = 600;
    packing.positions.setZero(3, n);
    packing.radii.resize(n);
    for (int i = 0; i < n; ++i)
    {
      for (int c = 0; c < dim; ++c)
        packing.positions(c, i) = (c + 1) * uniform() - 3.; // a box with unequal sides
      packing.radii[i] = (dim == 2 ? 0.02 : 0.09) * (0.5 + uniform());
    }
    const double tolerance = 0.3, gap = tolerance * packing.radii.mean();
    bond_by_gap(packing, tolerance);
    std::vector<std::array<int, 2>> expected;
    for (int i = 0; i < n; ++i)
      for (int j = i + 1; j < n; ++j)
        if ((packing.positions.col(i) - packing.positions.col(j)).norm() - packing.radii[i] - packing.radii[j] < gap)
          expected.push_back({i, j});
    ASSERT_GT(expected.size(), 500u);
    EXPECT_EQ(packing.bonds, expected);
    EXPECT_EQ(packing.gap_tolerance, tolerance);
    EXPECT_DOUBLE_EQ(packing.coordination(), 2. * double(expected.size()) / n);
  }
}

TEST(Bonds, AFarParticleCostsNoMemory)
{
  // Cells of the size of a particle over this box would be 1e16.
  Packing packing = from_points({{0., 0., 0.}, {1e-3, 0., 0.}, {1e5, 1e5, 0.}}, 0.5e-3);
  bond_by_gap(packing, 0.1);
  EXPECT_EQ(packing.bonds, (std::vector<std::array<int, 2>>{{0, 1}}));
}

TEST(LooseParticles, ChainsAndIslandsGo)
{
  // A rhombus of four, a chain of two hanging on it, and an island of three far away.
  const double h = std::sqrt(0.75);
  Packing packing = from_points({{-1., 0., 0.}, // end of the chain
                                 {0., 0., 0.},  // chain
                                 {10., 0., 0.},
                                 {11., 0., 0.},
                                 {10.5, h, 0.}, // island
                                 {1., 0., 0.},
                                 {2., 0., 0.},
                                 {1.5, h, 0.},
                                 {2.5, h, 0.}},
                                0.5);
  bond_by_gap(packing, 0.01);
  ASSERT_EQ(packing.bonds.size(), 2u + 3u + 5u);
  EXPECT_DOUBLE_EQ(remove_unconnected_particles(packing), 5. / 9.);
  ASSERT_EQ(packing.size(), 4);
  EXPECT_EQ(packing.positions.cols(), 4);
  EXPECT_EQ(packing.positions(0, 0), 1.);
  EXPECT_EQ(packing.positions(0, 3), 2.5);
  EXPECT_EQ(packing.bonds, (std::vector<std::array<int, 2>>{{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}}));
}

TEST(Packing, VolumesAndSolidFraction)
{
  Packing packing = from_points({{0.5, 0.5, 0.5}}, 0.5);
  packing.lower = Eigen::Vector3d::Zero();
  packing.upper = {2., 1., 0.};
  EXPECT_DOUBLE_EQ(packing.volume(0), std::acos(-1.) / 4.);
  EXPECT_DOUBLE_EQ(packing.solid_fraction(), std::acos(-1.) / 8.);
  packing.dim = 3;
  packing.upper[2] = 4.;
  EXPECT_DOUBLE_EQ(packing.volume(0), std::acos(-1.) / 6.);
  EXPECT_DOUBLE_EQ(packing.solid_fraction(), std::acos(-1.) / 48.);
}

TEST(PackingSettings, WrongOnesAreNamed)
{
  PackingSettings good = triangular(10., 10.), bad = good;
  EXPECT_EQ(error_of(good), "no error");
  bad.kind = "cubic";
  EXPECT_EQ(error_of(bad), "packing: kind 'cubic' is unknown, use random, triangular, fcc or hcp");
  bad = good;
  bad.dim = 3;
  EXPECT_EQ(error_of(bad), "packing: kind 'triangular' is a lattice in 2 dimensions, not 3");
  bad = good;
  bad.mean_diameter = 0.;
  EXPECT_EQ(error_of(bad), "packing: the mean diameter must be positive, not 0");
  bad = good;
  bad.radius_spread = 1.;
  EXPECT_EQ(error_of(bad), "packing: the radius spread must be in [0, 0.8], not 1");
  bad = good;
  bad.gap_tolerance = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(error_of(bad), "packing: the gap tolerance must be in [0, 2] mean radii, not nan");
  bad = good;
  bad.upper[1] = bad.lower[1];
  EXPECT_EQ(error_of(bad), "packing: side y of the box is 0 mean diameters long, it must be 4 to 100000");
}
