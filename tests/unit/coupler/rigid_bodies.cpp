// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/rigid_bodies.h"
#include "tests/support/rolling_disc.h"

#include <gtest/gtest.h>

#include <cmath>

using namespace kerf;
using Eigen::Vector3d;

// On the rim, on a flat side and on the half circle between them, outside and inside.
TEST(Disc, NearestPlaceOfARoundRim)
{
  Disc disc(test::rolling_disc(0.8));
  disc.move_to(0.5);
  const Vector3d centre(1.5, 2.45, 0.7);
  const Vector3d radial(0.6, -0.8, 0.), axial = Vector3d::UnitZ(), between = 0.8 * radial + 0.6 * axial;
  for (const double gap : {-0.1, 0.3})
  {
    const NearestSurface rim = disc.nearest(centre + (2. + gap) * radial);
    EXPECT_NEAR(rim.gap, gap, 1e-14);
    EXPECT_LT((rim.normal - radial).norm(), 1e-14);
    const NearestSurface side = disc.nearest(centre + 1.2 * radial - (0.4 + gap) * axial);
    EXPECT_NEAR(side.gap, gap, 1e-14);
    EXPECT_LT((side.normal + axial).norm(), 1e-14);
    const NearestSurface edge = disc.nearest(centre + 1.6 * radial + (0.4 + gap) * between);
    EXPECT_NEAR(edge.gap, gap, 1e-14);
    EXPECT_LT((edge.normal - between).norm(), 1e-14);
    // Rolling to the right turns clockwise: v = v_c + spin x arm, spin = -3/2.
    const Vector3d arm = 1.6 * radial + 0.4 * between;
    EXPECT_LT((edge.velocity - Vector3d(3., 0., 0.) - Vector3d(1.5 * arm[1], -1.5 * arm[0], 0.)).norm(), 1e-14);
  }
  EXPECT_LT(disc.nearest(centre - 2. * Vector3d::UnitY()).velocity.norm(), 1e-14);
}

// The search for contacts relies on it: the gap is a distance, it changes by no more than the point moves, and the normal is
// its gradient; the box holds what is nearer than its reach.
TEST(Disc, GapIsADistance)
{
  for (const double width : {0., 0.8})
  {
    Disc disc(test::rolling_disc(width));
    disc.move_to(0.);
    const double step = 1e-6;
    const Box box = disc.bounds(0.25);
    Vector3d before = disc.centre;
    for (int k = 1; k < 400; ++k)
    {
      const Vector3d point = disc.centre + Vector3d(2.6 * std::sin(1.3 * k), 2.6 * std::sin(2.1 * k), 0.9 * std::sin(3.7 * k));
      const NearestSurface there = disc.nearest(point);
      EXPECT_LE(std::abs(there.gap - disc.nearest(before).gap), (1. + 1e-14) * (point - before).norm());
      const bool inside = ((point - box.lower).array() > 0.).all() && ((box.upper - point).array() > 0.).all();
      EXPECT_TRUE(inside || there.gap > 0.25);
      Vector3d slope;
      for (int c = 0; c < 3; ++c)
        slope[c] = (disc.nearest(point + step * Vector3d::Unit(c)).gap - disc.nearest(point - step * Vector3d::Unit(c)).gap) /
                   (2. * step);
      EXPECT_LT((slope - there.normal).norm(), 1e-4) << point.transpose(); // curvature 1/(distance from the flat disc)
      before = point;
    }
  }
}

// The face of a platen is the integral of its speed; after the start-up it has lost half the start-up time.
TEST(Platen, MovesWithSmoothStart)
{
  const double speed = 0.3, ramp = 0.5;
  Platen platen(1., -1., -speed, ramp); // faces down
  double y = 1.;
  const double dt = 1e-4;
  for (int k = 0; k < 10000; ++k)
  {
    platen.move_to((k + 0.5) * dt);
    y += dt * platen.velocity;
  }
  platen.move_to(1.);
  EXPECT_NEAR(platen.y, 1. - speed * (1. - 0.5 * ramp), 1e-14);
  EXPECT_NEAR(platen.y, y, 1e-8); // midpoint rule, dt^2
  EXPECT_DOUBLE_EQ(platen.velocity, -speed);
  platen.move_to(0.);
  EXPECT_EQ(platen.velocity, 0.);
}
