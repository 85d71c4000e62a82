// SPDX-License-Identifier: GPL-2.0-or-later
// Packings that repeat themselves: lattices and random ones have no seam.
#include "dem_side/bond_network/bond_network.h"
#include "tests/support/dem_stiffness.h"
#include "tests/support/packing_checks.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
constexpr double d = 1e-3;
const double root2 = std::sqrt(2.), root3 = std::sqrt(3.);

/// Box of the given sides in diameters, not at the origin.
PackingSettings box(const std::string &kind, double width, double height, double depth = 0.)
{
  PackingSettings settings;
  settings.kind = kind;
  settings.dim = depth > 0. ? 3 : 2;
  settings.mean_diameter = d;
  settings.lower = {2e-3, -5e-3, settings.dim == 3 ? 1e-3 : 0.};
  settings.upper = settings.lower + d * Eigen::Vector3d(width, height, depth);
  settings.periodic = {{false, true, settings.dim == 3}};
  return settings;
}

/// A strip of @p columns planes across x, the first on the lower side.
Packing triangular_strip(int row_axis, int columns, int periods)
{
  PackingSettings settings =
    row_axis == 0 ? box("triangular", 0.5 * columns, root3 * periods) : box("triangular", 0.5 * root3 * columns, periods);
  settings.lattice.row_axis = row_axis;
  settings.lattice.plane_at = settings.lower[0];
  return generate_packing(settings);
}

Packing fcc_bar(int planes, int periods)
{
  PackingSettings settings = box("fcc", planes / root2, root2 * periods, root2 * (periods + 1));
  settings.lattice.plane_at = settings.lower[0];
  return generate_packing(settings);
}

/// Bonds whose images as stored are farther apart than the particles are: those across the seam at the end of an axis.
int bonds_across(const Packing &packing, int axis)
{
  int n = 0;
  for (const auto &[i, j] : packing.bonds)
    n += std::abs(packing.positions(axis, j) - packing.positions(axis, i)) > 0.5 * packing.periodic[axis];
  return n;
}

} // namespace

TEST(PeriodicPacking, ShortestDifferenceAndDisplacement)
{
  const Packing packing = triangular_strip(1, 20, 8);
  const double height = 8. * d;
  EXPECT_NEAR(packing.periodic[1], height, 1e-15);
  EXPECT_LT((packing.shortest({7e-3, 0.9 * height, 0.}) - Eigen::Vector3d(7e-3, -0.1 * height, 0.)).norm(), 1e-17);
  const Eigen::Vector3d move(1e-4, -2e-4, 0.), images(0., 3. * height, 0.);
  EXPECT_LT((packing.displacement(5, packing.positions.col(5) + move + images) - move).norm(), 1e-17);
  const Eigen::Vector3d back = packing.wrapped(packing.positions.col(5) + images);
  EXPECT_LT((back - packing.positions.col(5)).norm(), 1e-17);
  EXPECT_EQ(packing.wrapped(packing.lower - Eigen::Vector3d(0., 1e-30, 0.))[1], packing.lower[1]);
}

TEST(PeriodicPacking, TriangularStripHasNoSeam)
{
  for (const int row_axis : {0, 1})
  {
    const int columns = 24, periods = 6;
    const Packing packing = triangular_strip(row_axis, columns, periods);
    ASSERT_EQ(packing.size(), columns * periods);
    // One plane of particles exactly on the lower side, equal steps, none on the upper side: the bulk's solid fraction.
    const double step = (row_axis == 0 ? 0.5 : 0.5 * root3) * d;
    for (int i = 0; i < packing.size(); ++i)
    {
      const double plane = (packing.positions(0, i) - packing.lower[0]) / step;
      EXPECT_NEAR(plane, std::round(plane), 1e-12);
      EXPECT_LT(std::lround(plane), columns);
      EXPECT_GT(packing.positions(1, i), packing.lower[1] + 0.2 * d);
      EXPECT_LT(packing.positions(1, i), packing.upper[1] - 0.2 * d);
    }
    EXPECT_NEAR(packing.positions.row(0).minCoeff(), packing.lower[0], 1e-17);
    EXPECT_NEAR(packing.solid_fraction(), M_PI / (2. * root3), 1e-12);
    // Closed count: rows along y have a bond a particle in the column and two to the next column; rows along x have one a
    // particle to the next but one plane, two to the next plane.
    const int n = periods;
    EXPECT_EQ(packing.bonds.size(), static_cast<std::size_t>(row_axis == 1 ? columns * n + 2 * (columns - 1) * n
                                                                           : (columns - 2) * n + 2 * (columns - 1) * n));
    EXPECT_EQ(bonds_across(packing, 1), row_axis == 1 ? columns + (columns - 1) : columns - 1);
    const std::vector<int> count = partners(packing);
    for (int i = 0; i < packing.size(); ++i)
    {
      const double x = packing.positions(0, i);
      if (x > packing.lower[0] + 1.1 * d && x < packing.positions.row(0).maxCoeff() - 1.1 * d)
        EXPECT_EQ(count[i], 6);
    }
    for (const auto &[i, j] : packing.bonds)
      EXPECT_NEAR(packing.branch(i, j).norm(), d, 1e-12 * d);
  }
}

TEST(PeriodicPacking, FaceCentredCubicBarHasNoSeam)
{
  const int planes = 14, periods = 4;
  const Packing packing = fcc_bar(planes, periods);
  const int of_plane = 2 * periods * (periods + 1);
  ASSERT_EQ(packing.size(), planes * of_plane);
  EXPECT_NEAR(packing.solid_fraction(), M_PI / (3. * root2), 1e-12);
  EXPECT_NEAR(packing.positions.row(0).minCoeff(), packing.lower[0], 1e-17);
  EXPECT_EQ(packing.bonds.size(), static_cast<std::size_t>(2 * planes * of_plane + 4 * (planes - 1) * of_plane));
  const std::vector<int> count = partners(packing);
  const double last = packing.positions.row(0).maxCoeff();
  for (int i = 0; i < packing.size(); ++i)
    EXPECT_EQ(count[i],
              packing.positions(0, i) < packing.lower[0] + 0.1 * d || packing.positions(0, i) > last - 0.1 * d ? 8 : 12);
}

TEST(PeriodicPacking, BoxesThatDoNotFitAreNamed)
{
  PackingSettings wrong = box("triangular", 20., 10.);
  EXPECT_EQ(error_of(wrong), "packing: side y of the periodic box is 10 mean diameters long, the lattice needs a multiple of "
                             "1.732050808");
  wrong.lattice.row_axis = 1;
  EXPECT_EQ(error_of(wrong), "no error");
  wrong.upper[1] += 0.3 * d;
  EXPECT_EQ(error_of(wrong),
            "packing: side y of the periodic box is 10.3 mean diameters long, the lattice needs a multiple of 1");
  PackingSettings random = box("random", 20., 10.);
  random.periodic = {{true, false, false}};
  EXPECT_EQ(error_of(random), "packing: periodic axes are y in 2 dimensions");
  random.periodic = {{false, true, false}};
  random.lattice.plane_at = 0.;
  EXPECT_EQ(error_of(random), "packing: a random packing has no planes of particles to place");
}

// A seam would show as missing bonds: as many cross it as cross any other line along x, up to the scatter of counting (about 30
// and 100 bonds: 18 % and 10 %, three standard deviations are allowed). Walls would leave none.
TEST(PeriodicPacking, RandomOnesHaveNoSeam)
{
  for (const int dim : {2, 3})
  {
    PackingSettings settings = box("random", dim == 2 ? 30. : 10., dim == 2 ? 12. : 8., dim == 2 ? 0. : 8.);
    const Packing packing = generate_packing(settings);
    for (int c = 1; c < dim; ++c)
    {
      ASSERT_GE(packing.positions.row(c).minCoeff(), packing.lower[c]);
      ASSERT_LT(packing.positions.row(c).maxCoeff(), packing.upper[c]);
      Packing shifted = packing; // the seam comes to the middle
      for (int i = 0; i < packing.size(); ++i)
        shifted.positions.col(i) =
          packing.wrapped(packing.positions.col(i) + Eigen::Vector3d(0.5 * packing.periodic[c] * Eigen::Vector3d::Unit(c)));
      const double seam = bonds_across(packing, c), middle = bonds_across(shifted, c);
      EXPECT_NEAR(seam, middle, 3. * std::sqrt(2. * middle)) << dim;
      EXPECT_GT(middle, 20.);
      // The bonds are those of the pattern, wherever the box is cut.
      bond_by_gap(shifted, packing.gap_tolerance);
      EXPECT_EQ(shifted.bonds, packing.bonds);
    }
    EXPECT_LT(packing.quality.largest_overlap, 1e-3);
    EXPECT_NEAR(packing.mean_diameter, d, 0.01 * d);
  }
}

// Closed moduli of the lattice, plane strain. Every particle of the strip carries the same stress, so round-off is all that is
// left, also in a strip of a few particles' height.
TEST(PeriodicModuli, TriangularStrip)
{
  const double k_n = 3e10;
  for (const int row_axis : {0, 1})
    for (const double ratio : {0.2, 0.5, 1.})
    {
      const Packing packing = triangular_strip(row_axis, row_axis == 0 ? 48 : 28, row_axis == 0 ? 3 : 5);
      const double unit = root3 / 4. * k_n;
      Eigen::Matrix3d exact;
      exact << 3. + ratio, 1. - ratio, 0., 1. - ratio, 3. + ratio, 0., 0., 0., 1. + ratio;
      const Moduli moduli = relaxed_moduli(packing, k_n, ratio * k_n);
      EXPECT_LE((moduli.stiffness / unit - exact).cwiseAbs().maxCoeff(), 1e-10) << moduli.stiffness / unit;
      EXPECT_NEAR(moduli.young / (root3 / 8. * k_n * (1. + ratio) * (5. - ratio)), 1., 1e-10);
      EXPECT_NEAR(moduli.poisson, (1. - ratio) / 4., 1e-10);
    }
}

// Twelve bonds along (1 1 0)/sqrt(2) and so on, each with the stiffness k_t 1 + (k_n - k_t) n n, over the volume sqrt(2)/2 d^3
// a particle: C11 = sqrt(2)(k_n + k_t)/d, C12 = (k_n - k_t)/(sqrt(2) d). Shear with free rotations is that of the stresses'
// symmetric part, C44 = (k_n + k_t)/(sqrt(2) d).
TEST(PeriodicModuli, FaceCentredCubicBar)
{
  const double k_n = 3e6;
  for (const double ratio : {0.2, 1.})
  {
    const Moduli moduli = relaxed_moduli(fcc_bar(20, 4), k_n, ratio * k_n);
    Eigen::Matrix<double, 6, 6> exact = Eigen::Matrix<double, 6, 6>::Zero();
    exact.topLeftCorner<3, 3>().setConstant((1. - ratio) / root2);
    exact.diagonal() << Eigen::Vector3d::Constant(root2 * (1. + ratio)), Eigen::Vector3d::Constant((1. + ratio) / root2);
    EXPECT_LE((moduli.stiffness * d / k_n - exact).cwiseAbs().maxCoeff(), 1e-10) << moduli.stiffness * d / k_n;
  }
}

// The pattern has the same moduli and frequencies wherever its seam is.
TEST(PeriodicModuli, OfARandomStripDoNotDependOnTheSeam)
{
  const Packing packing = generate_packing(box("random", 20., 8.));
  Packing shifted = packing;
  for (int i = 0; i < packing.size(); ++i)
    shifted.positions.col(i) = packing.wrapped(packing.positions.col(i) + Eigen::Vector3d(0., 3.3 * d, 0.));
  const Moduli a = relaxed_moduli(packing, 1., 0.3), b = relaxed_moduli(shifted, 1., 0.3);
  EXPECT_LE((a.stiffness - b.stiffness).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(largest_frequency(packing, 1e9, 3e8, 2700.) / largest_frequency(shifted, 1e9, 3e8, 2700.), 1., 1e-9);
}

// omega^2 m / k_n = max(6 + 2 k, 4.5 (1 + k), 24 k) at the zone edge of the infinite lattice; the estimate is safe by 1 %. Cut
// across y only, the strip has the highest mode of the lattice but for its two ends.
TEST(PeriodicFrequency, TriangularStrip)
{
  const Packing packing = triangular_strip(1, 60, 6);
  const double k_n = 2e10, density = 2700.;
  for (const double ratio : {0.1, 0.5})
  {
    const double exact =
      std::sqrt(std::max({6. + 2. * ratio, 4.5 * (1. + ratio), 24. * ratio}) * k_n / (density * packing.volume(0)));
    const double found = largest_frequency(packing, k_n, ratio * k_n, density);
    EXPECT_GE(found, exact * 0.999);
    EXPECT_LE(found, 1.015 * exact);
  }
}
