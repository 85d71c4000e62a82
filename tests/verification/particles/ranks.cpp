// SPDX-License-Identifier: GPL-2.0-or-later
// The same run on all ranks together and on each rank alone.
#include "tests/support/dem_test_packings.h"

#include <algorithm>
#include <array>
#include <gtest/gtest.h>
#include <tuple>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
using Break = std::tuple<std::int64_t, int, int, int>;

/// Broken bonds of all ranks, sorted.
std::vector<Break> breaks(const DemSide &dem, MPI_Comm comm)
{
  std::vector<std::int64_t> local;
  for (const BrokenBond &b : dem.broken_bonds())
    local.insert(local.end(), {b.step, b.first, b.second, b.shear});
  int n_ranks = 0;
  MPI_Comm_size(comm, &n_ranks);
  std::vector<int> counts(n_ranks), offsets(n_ranks, 0);
  const int n = static_cast<int>(local.size());
  MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  for (int r = 1; r < n_ranks; ++r)
    offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<std::int64_t> all(offsets.back() + counts.back());
  MPI_Allgatherv(local.data(), n, MPI_INT64_T, all.data(), counts.data(), offsets.data(), MPI_INT64_T, comm);
  std::vector<Break> result;
  for (std::size_t i = 0; i < all.size(); i += 4)
    result.emplace_back(all[i], static_cast<int>(all[i + 1]), static_cast<int>(all[i + 2]), static_cast<int>(all[i + 3]));
  std::sort(result.begin(), result.end());
  return result;
}

/// Pairs that are bonded at present, of all ranks, sorted.
std::vector<std::array<int, 2>> bonded_pairs(const DemSide &dem, MPI_Comm comm)
{
  std::vector<int> local;
  for (const ActiveBond &bond : dem.bonds())
    local.insert(local.end(), {bond.first, bond.second});
  int n_ranks = 0;
  MPI_Comm_size(comm, &n_ranks);
  std::vector<int> counts(n_ranks), offsets(n_ranks, 0);
  const int n = static_cast<int>(local.size());
  MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  for (int r = 1; r < n_ranks; ++r)
    offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<int> all(offsets.back() + counts.back());
  MPI_Allgatherv(local.data(), n, MPI_INT, all.data(), counts.data(), offsets.data(), MPI_INT, comm);
  std::vector<std::array<int, 2>> pairs;
  for (std::size_t i = 0; i < all.size(); i += 2)
    pairs.push_back({{all[i], all[i + 1]}});
  std::sort(pairs.begin(), pairs.end());
  return pairs;
}

struct Result
{
  Eigen::Matrix3Xd position, velocity, spin;
  std::vector<std::array<int, 2>> bonded;
  std::vector<Break> broken;
  std::int64_t intact = 0;
  Energies energies;
};

/// A body that perturbations and drifts by (1.2, 0.7) diameters, in space by 0.9 along z, so that particles change rank and
/// take their bonds along.
struct Motion
{
  double noise; // of the velocities [m/s]
  int steps = 500;
  static constexpr int late = 100; // a fifth of the particles is inserted after these steps
};

Result run(const Packing &packing, Settings s, MPI_Comm comm, const Motion &motion)
{
  s.comm = comm;
  DemSide dem(s);
  const Eigen::Vector3d drift =
    packing.mean_diameter / (motion.steps * s.time_step) * Eigen::Vector3d(1.2, 0.7, packing.dim == 2 ? 0. : 0.9);
  std::vector<NewParticle> first, second;
  for (NewParticle p : all_particles(packing))
  {
    for (int c = 0; c < packing.dim; ++c)
      p.velocity[c] = motion.noise * noise(6 * p.index + c) + drift[c];
    p.angular_velocity[2] = motion.noise / packing.mean_diameter * noise(6 * p.index + 3);
    if (p.index % 5 == 0)
      p.displacement = motion.late * s.time_step * drift;
    (p.index % 5 == 0 ? second : first).push_back(p);
  }
  start(dem, packing, first);
  dem.advance(motion.late, {});
  dem.insert(second);
  Eigen::VectorXd weight(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    weight[i] = 0.75 + 0.25 * std::sin(packing.positions(0, i) * 1e3);
  dem.set_weights(weight);
  dem.setup({});
  dem.advance(motion.steps - motion.late, {});
  return {gather(dem, packing, Quantity::position, comm),
          gather(dem, packing, Quantity::velocity, comm),
          gather(dem, packing, Quantity::angular_velocity, comm),
          bonded_pairs(dem, comm),
          breaks(dem, comm),
          dem.n_bonds_intact(),
          dem.energies()};
}

void expect_near(const Eigen::Matrix3Xd &a, const Eigen::Matrix3Xd &b, double tolerance)
{
  EXPECT_LT((a - b).colwise().norm().maxCoeff(), tolerance * b.colwise().norm().maxCoeff());
}

/// Returns the run alone.
Result compare(const Packing &packing, const Settings &s, const Motion &motion)
{
  const double tolerance = 1e-9; // other orders of summation: 1e-16 a step, a stable body hardly amplifies it
  const Result alone = run(packing, s, MPI_COMM_SELF, motion);
  const Result together = run(packing, s, MPI_COMM_WORLD, motion);
  expect_near(together.position, alone.position, tolerance);
  expect_near(together.velocity, alone.velocity, tolerance);
  expect_near(together.spin, alone.spin, tolerance);
  EXPECT_EQ(together.broken, alone.broken);
  EXPECT_EQ(together.intact, alone.intact);
  EXPECT_EQ(together.bonded, alone.bonded);
  // Every bond of the store is either intact or broken, once.
  std::vector<std::array<int, 2>> of_store = together.bonded;
  for (const Break &b : together.broken)
    of_store.push_back({{std::get<1>(b), std::get<2>(b)}});
  std::sort(of_store.begin(), of_store.end());
  std::vector<std::array<int, 2>> stored = packing.bonds;
  std::sort(stored.begin(), stored.end());
  EXPECT_EQ(of_store, stored);
  EXPECT_EQ(static_cast<std::size_t>(together.intact), together.bonded.size());
  const auto near = [&](double a, double b)
  { EXPECT_NEAR(a, b, 10. * tolerance * (alone.energies.kinetic + alone.energies.damping)); };
  near(together.energies.kinetic, alone.energies.kinetic);
  near(together.energies.elastic, alone.energies.elastic);
  near(together.energies.damping, alone.energies.damping);
  near(together.energies.friction, alone.energies.friction);
  near(together.energies.released, alone.energies.released);
  if (packing.dim == 2) // nothing leaves the plane, to the last bit
  {
    EXPECT_TRUE(together.position.row(2).isZero(0.) && together.velocity.row(2).isZero(0.));
    EXPECT_TRUE(together.spin.topRows(2).isZero(0.));
  }
  return alone;
}
} // namespace

TEST(DemRanks, ElasticBodyMovesTheSame)
{
  for (const Packing &packing : {triangular_lattice(16, 16, 5e-4), fcc_lattice(3, 5e-4)})
  {
    Settings s = settings(packing);
    s.bond.damping = 0.02;
    s.local_damping = 0.02;
    EXPECT_TRUE(compare(packing, s, Motion{0.5}).broken.empty());
  }
}

TEST(DemRanks, SameBondsBreakInTheSameSteps)
{
  for (const Packing &packing : {triangular_lattice(16, 16, 5e-4), fcc_lattice(4, 5e-4)})
  {
    Settings s = settings(packing);
    if (packing.dim == 3)
      s.time_step *= std::sqrt(6.5 / 10.);           // FCC with free rotations: omega_max^2 = 40 k_t / m
    const double weak = packing.dim == 2 ? 1. : 0.3; // vibrations are smaller in space
    s.bond.R_n = weak * 2e-3 * packing.mean_diameter * s.bond.k_n;
    s.bond.R_t = weak * 5e-4 * packing.mean_diameter * s.bond.k_n;
    // Short: breaks and contacts amplify round-off, after 500 steps up to the tolerance.
    const Result alone = compare(packing, s, Motion{packing.dim == 2 ? 1. : 10., 350});
    EXPECT_GT(alone.broken.size(), packing.bonds.size() / 10);
    EXPECT_GT(alone.intact, 0);
  }
}

// Particles that have moved by little, and other weights, need no new lists: forces and torques are those of a whole setup.
TEST(DemRanks, ForcesWithTheListsOfBefore)
{
  for (const Packing &packing : {triangular_lattice(16, 16, 5e-4), fcc_lattice(3, 5e-4)})
  {
    Settings s = settings(packing);
    s.bond.damping = 0.02; // its viscosity follows the masses
    s.comm = MPI_COMM_WORLD;
    DemSide dem(s);
    std::vector<NewParticle> all = all_particles(packing);
    for (NewParticle &p : all)
      for (int c = 0; c < packing.dim; ++c)
        p.velocity[c] = noise(6 * p.index + c);
    start(dem, packing, all);
    Particles particles = dem.particles();
    for (int i = 0; i < particles.n; ++i)
    {
      for (int c = 0; c < packing.dim; ++c)
        particles.position(c, i) += 1e-3 * packing.mean_diameter * noise(6 * particles.index[i] + 3 + c);
      const double turn = 1e-3 * noise(6 * particles.index[i] + 2);
      Eigen::Map<Eigen::Vector4d>(particles.rotation + 4 * i) << std::cos(0.5 * turn), 0., 0., std::sin(0.5 * turn);
    }
    Eigen::VectorXd weight(packing.size());
    for (int i = 0; i < packing.size(); ++i)
      weight[i] = 0.75 + 0.25 * std::sin(packing.positions(0, i) * 1e3);
    dem.set_weights(weight);
    dem.compute_forces({});
    const Eigen::Matrix3Xd force = gather(dem, packing, Quantity::force), torque = gather(dem, packing, Quantity::torque);
    dem.setup({});
    // The order of summation may differ after the lists were built: round-off of 12 forces of stiffness times position.
    expect_near(force, gather(dem, packing, Quantity::force), 1e-10);
    expect_near(torque, gather(dem, packing, Quantity::torque), 1e-10);
  }
}

TEST(DemRanks, NewParticlesNeedNewLists)
{
  const Packing packing = triangular_lattice(8, 8, 5e-4);
  DemSide dem(settings(packing));
  std::vector<NewParticle> all = all_particles(packing), last(all.end() - 1, all.end());
  all.pop_back();
  start(dem, packing, all);
  dem.insert(last);
  EXPECT_THROW(dem.compute_forces({}), std::logic_error);
}

// A region that grows in a corner of a large domain is shared by all ranks, and the body does not notice.
TEST(DemRanks, ShareTheParticles)
{
  constexpr int n_x = 40, n_y = 24, first_part = 16, growth = 4; // columns
  const Packing packing = triangular_lattice(n_x, n_y, 5e-4);
  Settings s = settings(packing);
  s.domain_lower.x() -= packing.upper.x();
  s.domain_upper += 5. * packing.upper;
  DemSide dem(s);
  int n_ranks = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  for (int begin = 0, end = first_part; begin < n_x; begin = end, end += growth)
  {
    std::vector<NewParticle> next;
    for (const NewParticle &p : all_particles(packing))
      if (p.index % n_x >= begin && p.index % n_x < end)
        next.push_back(p);
    start(dem, packing, next);
    dem.advance(50, {});
    int most = dem.particles().n;
    MPI_Allreduce(MPI_IN_PLACE, &most, 1, MPI_INT, MPI_MAX, MPI_COMM_WORLD);
    // A tenth is borne before borders move, on each of two axes, and half a column of a rank's four or more is not split.
    EXPECT_LT(most * n_ranks, 1.35 * dem.n_active()) << end << " columns";
  }
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
  EXPECT_LT(gather(dem, packing, Quantity::force).norm(), 1e-10 * s.bond.k_n * packing.mean_diameter);
}

TEST(DemRanks, SameBreaksWhereBordersMove)
{
  const Packing packing = triangular_lattice(16, 16, 5e-4);
  Settings s = settings(packing);
  s.domain_lower.x() -= 0.5 * packing.upper.x();
  s.domain_upper += 2. * packing.upper;
  s.bond.R_n = 2e-3 * packing.mean_diameter * s.bond.k_n;
  s.bond.R_t = 5e-4 * packing.mean_diameter * s.bond.k_n;
  EXPECT_GT(compare(packing, s, Motion{1., 350}).broken.size(), packing.bonds.size() / 10);
}
