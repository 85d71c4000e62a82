// SPDX-License-Identifier: GPL-2.0-or-later
// What the benchmarks compare is the same body under the same law.
#include "tests/benchmarks/fcc_block.h"
#include "tests/benchmarks/plain_bond_loop.h"
#include "tests/support/dem_test_packings.h"

#include <algorithm>
#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

TEST(DemBenchmark, FccBlockHasTwelveBondsASphere)
{
  const int n = 4;
  const double r = 5e-4;
  const Packing packing = benchmarks::fcc_block(n, r);
  ASSERT_EQ(packing.size(), 4 * n * n * n);
  // All pairs of touching spheres, found without the lattice.
  Packing expected = packing;
  expected.bonds.clear();
  bond_near_pairs(expected, 2.01 * r);
  EXPECT_EQ(packing.bonds, expected.bonds);
  EXPECT_TRUE(std::is_sorted(packing.bonds.begin(), packing.bonds.end()));
  std::vector<int> bonds(packing.size(), 0);
  for (const auto &[a, b] : packing.bonds)
  {
    EXPECT_NEAR((packing.positions.col(a) - packing.positions.col(b)).norm(), 2. * r, 1e-14 * n * r);
    ++bonds[a], ++bonds[b];
  }
  int inner = 0;
  for (int i = 0; i < packing.size(); ++i)
    if ((packing.positions.col(i).array() > packing.lower.array() + 2. * r).all() &&
        (packing.positions.col(i).array() < packing.upper.array() - 2. * r).all())
    {
      EXPECT_EQ(bonds[i], 12);
      ++inner;
    }
  EXPECT_GT(inner, packing.size() / 4);
}

TEST(DemBenchmark, PlainLoopMovesTheBlockAlike)
{
  const Packing packing = benchmarks::fcc_block(3, 5e-4);
  for (const double damping : {0., 0.1})
  {
    Settings s = settings(packing);
    s.bond.damping = damping;
    DemSide dem(s);
    benchmarks::PlainBondLoop plain(packing, s.bond, s.density, s.time_step);
    auto particles = all_particles(packing);
    const double speed = 1e-2; // [m/s]
    for (NewParticle &p : particles)
      for (int c = 0; c < 3; ++c)
      {
        plain.particles[p.index].v[c] = p.velocity[c] = speed * noise(6 * p.index + c);
        plain.particles[p.index].spin[c] = p.angular_velocity[c] = speed / packing.mean_diameter * noise(6 * p.index + 3 + c);
      }
    // Damping acts before the first step only in DemSide, whose setup knows the velocities.
    start(dem, packing, particles,
          [&](Phase, Particles &p)
          {
            p.force.setZero();
            p.torque.setZero();
          });
    const int steps = 100; // several periods of the fastest waves
    dem.advance(steps, {});
    plain.advance(steps);

    const Eigen::Matrix3Xd x = gather(dem, packing, Quantity::position), v = gather(dem, packing, Quantity::velocity),
                           w = gather(dem, packing, Quantity::angular_velocity);
    double displacement = 0., x_error = 0., v_error = 0., w_error = 0.;
    for (int i = 0; i < packing.size(); ++i)
    {
      const auto &p = plain.particles[i];
      displacement = std::max(displacement, (x.col(i) - packing.positions.col(i)).norm());
      x_error = std::max(x_error, (x.col(i) - Eigen::Map<const Eigen::Vector3d>(p.x)).norm());
      v_error = std::max(v_error, (v.col(i) - Eigen::Map<const Eigen::Vector3d>(p.v)).norm());
      w_error = std::max(w_error, (w.col(i) - Eigen::Map<const Eigen::Vector3d>(p.spin)).norm());
    }
    // The total and the incremental law differ by the strain, here displacement / diameter = 1e-5, relative; waves add up a few
    // of these.
    const double strain = displacement / packing.mean_diameter;
    EXPECT_GT(strain, 1e-6);
    EXPECT_LT(x_error, 10. * strain * displacement);
    EXPECT_LT(v_error, 10. * strain * v.colwise().norm().maxCoeff());
    EXPECT_LT(w_error, 10. * strain * w.colwise().norm().maxCoeff());
  }
}
