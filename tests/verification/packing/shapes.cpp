// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"
#include "dem_side/packing/packing.h"
#include "tests/support/test_surfaces.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using Eigen::Vector3d;

namespace
{
constexpr double d = 1e-3;

Packing fill(int dim, const SurfaceMesh &surface)
{
  PackingSettings settings;
  settings.dim = dim;
  settings.mean_diameter = d;
  settings.radius_spread = 0.3;
  settings.surface = std::make_shared<SurfaceMesh>(surface);
  settings.lower = surface.points.rowwise().minCoeff().array() - d; // the box around may be larger
  settings.upper = surface.points.rowwise().maxCoeff().array() + d;
  return generate_packing(settings);
}

/// What the particles' outermost points are to the walls [mean diameters].
struct WallContact
{
  double farthest_out; ///< largest protrusion
  double touching;     ///< particles within 0.05 d of the wall, over how many of diameter d side by side cover it
};

WallContact wall_contact(const Packing &packing, const SurfaceMesh &mesh)
{
  const ClosedSurface surface(packing.dim, mesh, d);
  WallContact result{-1e300, 0.};
  for (int i = 0; i < packing.size(); ++i)
  {
    const Vector3d x = packing.positions.col(i);
    EXPECT_TRUE(surface.contains(x));
    for (const auto &foot : surface.feet(x, d))
    {
      result.farthest_out = std::max(result.farthest_out, (packing.radii[i] - foot.distance) / d);
      result.touching +=
        std::abs(packing.radii[i] - foot.distance) < 0.05 * d ? std::pow(2. * packing.radii[i], packing.dim - 1) : 0.;
      break;
    }
  }
  result.touching /= surface.area();
  return result;
}
} // namespace

TEST(PackingShapes, DiscIsRoundAndDense)
{
  const SurfaceMesh surface = test::disc(180, 25. * d, {0.03, 0.05, 0.});
  const Packing packing = fill(2, surface); // about 2000 discs
  const WallContact wall = wall_contact(packing, surface);
  EXPECT_LE(wall.farthest_out, 0.01);
  EXPECT_GE(wall.touching, 0.7); // discs side by side along the wall
  // A box of the same length of wall per area has 0.84; packings of this size scatter by 0.5 %.
  EXPECT_NEAR(packing.solid_fraction(), 0.84, 0.015);
  EXPECT_GE(packing.coordination(), 4.4);
  EXPECT_NEAR(packing.mean_diameter, d, 0.01 * d);
  EXPECT_NEAR(packing.volume_filled, 0.5 * 180. * std::sin(2. * std::acos(-1.) / 180.) * 625. * d * d, 1e-12);
  EXPECT_LE(packing.quality.largest_overlap, 0.01);
  // The bonds leave no direction out: of 1000 random ones the fabric scatters by 3 %.
  EXPECT_GE(packing.quality.isotropy, 0.88);
}

TEST(PackingShapes, LShapeIsFilledIntoItsCorners)
{
  const SurfaceMesh surface = test::l_shape(44. * d);
  const Packing packing = fill(2, surface);
  const WallContact wall = wall_contact(packing, surface);
  EXPECT_LE(wall.farthest_out, 0.01);
  EXPECT_GE(wall.touching, 0.7);
  EXPECT_NEAR(packing.solid_fraction(), 0.84, 0.015);
  // Each of the three squares is as full as the others.
  for (const Vector3d &lower : {Vector3d(0., 0., 0.), Vector3d(22. * d, 0., 0.), Vector3d(0., 22. * d, 0.)})
  {
    double solid = 0.;
    for (int i = 0; i < packing.size(); ++i)
    {
      const Vector3d x = packing.positions.col(i) - lower;
      solid += x.head<2>().minCoeff() >= 0. && x.head<2>().maxCoeff() < 22. * d ? packing.volume(i) : 0.;
    }
    EXPECT_NEAR(solid / (484. * d * d), 0.84, 0.03); // +- 1 of 22 rows cut by the line between the squares
  }
}

TEST(PackingShapes, SphereIsRoundAndDense)
{
  const SurfaceMesh surface = test::sphere(2, 7. * d, {0.02, 0.02, 0.02});
  const Packing packing = fill(3, surface); // about 1500 spheres
  const WallContact wall = wall_contact(packing, surface);
  EXPECT_LE(wall.farthest_out, 0.01);
  EXPECT_GE(wall.touching, 0.45);
  // A box with the same wall per volume (3 / R = 6 / L, L = 14 d) has 0.61.
  EXPECT_NEAR(packing.solid_fraction(), 0.61, 0.02);
  EXPECT_NEAR(packing.mean_diameter, d, 0.01 * d);
  EXPECT_LE(packing.quality.largest_overlap, 0.01);
}

TEST(PackingShapes, NonConvexPrismIsFilled)
{
  const SurfaceMesh surface = test::l_prism(14. * d, 8. * d);
  const Packing packing = fill(3, surface);
  const WallContact wall = wall_contact(packing, surface);
  EXPECT_LE(wall.farthest_out, 0.01);
  EXPECT_NEAR(packing.volume_filled, 0.75 * 14. * 14. * 8. * d * d * d, 1e-9 * d * d * d);
  EXPECT_NEAR(packing.solid_fraction(), 0.60, 0.02); // walls: 0.68 of area per volume in diameters, in the sphere 0.43
}

TEST(PackingShapes, LatticeStaysInside)
{
  PackingSettings settings;
  settings.dim = 3;
  settings.kind = "fcc";
  settings.mean_diameter = d;
  const SurfaceMesh surface = test::sphere(3, 8. * d, Vector3d::Zero());
  settings.surface = std::make_shared<SurfaceMesh>(surface);
  settings.lower.setConstant(-0.01);
  settings.upper.setConstant(0.01);
  const Packing packing = generate_packing(settings);
  EXPECT_GT(packing.solid_fraction(), 0.55); // 0.74 inside, but nothing within half a layer of the wall
  EXPECT_LE((packing.positions.colwise().norm().transpose() + packing.radii).maxCoeff(), 8. * d);
}

TEST(PackingShapes, SurfacesThatDoNotFitAreNamed)
{
  PackingSettings settings;
  settings.mean_diameter = d;
  settings.upper = {20. * d, 20. * d, 0.};
  settings.surface = std::make_shared<SurfaceMesh>(test::disc(50, 10. * d, {0.011, 0.01, 0.}));
  try
  {
    generate_packing(settings);
    FAIL() << "no error";
  }
  catch (const std::invalid_argument &error)
  {
    EXPECT_STREQ(error.what(),
                 "packing: the surface reaches from 0.001 to 0.021 m along x, it must be inside of the box from 0 to 0.02");
  }
}
