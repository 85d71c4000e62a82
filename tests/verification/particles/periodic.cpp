// SPDX-License-Identifier: GPL-2.0-or-later
// Strips and bars that repeat themselves: the particle side at the seam.
#include "dem_side/bond_network/bond_network.h"
#include "tests/support/dem_test_packings.h"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <map>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
constexpr double d = 1e-3;
const double root2 = std::sqrt(2.), root3 = std::sqrt(3.);

/// Planes of particles across x, the first at x = 0.
Packing strip(int columns, int periods)
{
  PackingSettings settings;
  settings.kind = "triangular";
  settings.mean_diameter = d;
  settings.upper = d * Eigen::Vector3d(0.5 * root3 * columns, periods, 0.);
  settings.periodic = {{false, true, false}};
  settings.lattice = {1, 0.};
  return generate_packing(settings);
}

Packing bar(int planes, int periods)
{
  PackingSettings settings;
  settings.kind = "fcc";
  settings.dim = 3;
  settings.mean_diameter = d;
  settings.upper = d * Eigen::Vector3d(planes / root2, root2 * periods, root2 * periods);
  settings.periodic = {{false, true, true}};
  settings.lattice.plane_at = 0.;
  return generate_packing(settings);
}

int plane_of(const Packing &packing, int i)
{
  return static_cast<int>(std::lround(packing.positions(0, i) / (packing.dim == 2 ? 0.5 * root3 * d : d / root2)));
}

std::vector<ActiveBond> all_bonds(const DemSide &dem)
{
  const std::vector<ActiveBond> local = dem.bonds();
  int n_ranks = 0;
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  std::vector<int> counts(n_ranks), offsets(n_ranks, 0);
  const int bytes = static_cast<int>(local.size() * sizeof(ActiveBond));
  MPI_Allgather(&bytes, 1, MPI_INT, counts.data(), 1, MPI_INT, MPI_COMM_WORLD);
  for (int r = 1; r < n_ranks; ++r)
    offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<ActiveBond> all((offsets.back() + counts.back()) / sizeof(ActiveBond));
  MPI_Allgatherv(local.data(), bytes, MPI_BYTE, all.data(), counts.data(), offsets.data(), MPI_BYTE, MPI_COMM_WORLD);
  return all;
}

Eigen::Vector3d momentum(DemSide &dem)
{
  const Particles p = dem.particles();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int i = 0; i < p.n; ++i)
    sum += p.mass[i] * p.velocity.col(i);
  MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return sum;
}

/// Columns of a field that agree to the tolerance times @p scale within each plane of particles.
void expect_uniform_planes(const Packing &packing, const Eigen::Matrix3Xd &field, double scale)
{
  std::map<int, Eigen::Vector3d> of_plane;
  double worst = 0.;
  for (int i = 0; i < packing.size(); ++i)
  {
    const auto entry = of_plane.emplace(plane_of(packing, i), field.col(i));
    worst = std::max(worst, (entry.first->second - field.col(i)).norm());
  }
  EXPECT_LT(worst, scale);
}

Eigen::Matrix3Xd displacements(DemSide &dem, const Packing &packing)
{
  Eigen::Matrix3Xd u = gather(dem, packing, Quantity::position);
  for (int i = 0; i < packing.size(); ++i)
    u.col(i) = packing.displacement(i, u.col(i));
  return u;
}
} // namespace

// Uniform stretch along x and shear across it keep the lattice periodic. Opposite bonds of a particle carry the same force:
// none is left over on the planes inside, also at the seam, and every bond has the closed elongation |F b| - d. Round-off of
// positions (1e-18 m) over the elongation (1e-6 m).
TEST(DemPeriodic, UniformStrainOfALatticeHasNoSurfaceAtTheSeam)
{
  for (const Packing &packing : {strip(16, 6), bar(10, 4)})
  {
    const Settings s = settings(packing);
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
    gradient.col(0) << 1e-3, 2e-3, packing.dim == 3 ? -1e-3 : 0.;
    DemSide dem(s);
    auto particles = all_particles(packing);
    for (NewParticle &p : particles)
      p.displacement = gradient * packing.positions.col(p.index);
    start(dem, packing, particles);

    EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
    const std::vector<ActiveBond> bonds = all_bonds(dem);
    ASSERT_EQ(bonds.size(), packing.bonds.size());
    const double scale = s.bond.k_n * 1e-3 * d;
    for (const ActiveBond &bond : bonds)
    {
      const Eigen::Vector3d branch = packing.branch(bond.first, bond.second);
      EXPECT_NEAR(bond.normal_force, s.bond.k_n * ((branch + gradient * branch).norm() - d), 1e-10 * scale);
    }
    const Eigen::Matrix3Xd force = gather(dem, packing, Quantity::force), torque = gather(dem, packing, Quantity::torque);
    int last = 0;
    for (int i = 0; i < packing.size(); ++i)
      last = std::max(last, plane_of(packing, i));
    for (int i = 0; i < packing.size(); ++i)
      if (plane_of(packing, i) > 1 && plane_of(packing, i) < last - 1)
        EXPECT_LT(force.col(i).norm(), 1e-10 * scale);
    expect_uniform_planes(packing, force, 1e-10 * scale);
    expect_uniform_planes(packing, torque, 1e-10 * scale * d);
  }
}

namespace
{
/// Runs a pulse that depends on x only.
void run_plane_pulse(const Packing &packing, int direction)
{
  Settings s = settings(packing);
  const double amplitude = 1e-4 * d, half = 4. * d, centre = 8. * d;
  DemSide dem(s);
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
  {
    const double x = (packing.positions(0, p.index) - centre) / half;
    if (std::abs(x) < 1.)
      p.displacement[direction] = amplitude * std::pow(std::cos(0.5 * M_PI * x), 2);
  }
  start(dem, packing, particles);
  const Eigen::Vector3d before = momentum(dem);
  dem.advance(400, {});
  // Particles of a plane move alike, and a pressure pulse along x only. Round-off of positions is 1e-11 of the amplitude.
  const Eigen::Matrix3Xd u = displacements(dem, packing);
  expect_uniform_planes(packing, u, 1e-9 * amplitude);
  expect_uniform_planes(packing, gather(dem, packing, Quantity::angular_velocity), 1e-9 * amplitude / (d * s.time_step));
  EXPECT_GT(u.row(direction).cwiseAbs().maxCoeff(), 0.1 * amplitude);
  if (direction == 0)
    EXPECT_LT(u.bottomRows(2).cwiseAbs().maxCoeff(), 1e-9 * amplitude);
  const double mass = s.density * packing.volume(0) * packing.size();
  EXPECT_LT((momentum(dem) - before).norm(), 1e-9 * mass * amplitude / (400. * s.time_step));
}
} // namespace

TEST(DemPeriodic, PlanePulsesStayPlane)
{
  for (const int direction : {0, 1})
  {
    run_plane_pulse(strip(24, 6), direction);
    run_plane_pulse(bar(24, 4), direction);
  }
}

// Standing wave along x about the middle of a strip of six particles' height, against the dispersion relation of the infinite
// lattice (propagation across the rows). The ends are not felt within 3/4 of a period; 0.1 %, of which central differences take
// (omega dt)^2 / 24 = 1e-5.
TEST(DemPeriodic, PressureWavesHaveTheDispersionOfTheInfiniteLattice)
{
  const Packing packing = strip(61, 6);
  Settings s = settings(packing);
  const double m = s.density * packing.volume(0), middle = 30. * 0.5 * root3 * d;
  for (const double length : {3., 5., 10.})
  {
    const double q = 2. * M_PI / (length * d);
    const double omega = std::sqrt((3. * s.bond.k_n + s.bond.k_t) * (1. - std::cos(0.5 * root3 * q * d)) / m);
    constexpr int steps_a_period = 400;
    s.time_step = 2. * M_PI / omega / steps_a_period;
    const double amplitude = 1e-7 * d; // linear to 1e-7, positions to 1e-9 of it
    auto particles = all_particles(packing);
    for (NewParticle &p : particles)
      p.displacement[0] = amplitude * std::cos(q * (packing.positions(0, p.index) - middle));
    DemSide dem(s);
    start(dem, packing, particles);
    dem.advance(steps_a_period / 4 - 10, {});
    // Crossings of zero of the middle plane, at a quarter of a period.
    double before = 0., crossing = 0.;
    for (int n = steps_a_period / 4 - 10; n < steps_a_period / 4 + 10 && crossing == 0.; ++n)
    {
      const Eigen::Matrix3Xd u = displacements(dem, packing);
      double now = 0.;
      for (int i = 0; i < packing.size(); ++i)
        if (plane_of(packing, i) == 30)
          now = u(0, i);
      if (before > 0. && now <= 0.)
        crossing = (n - 1 + before / (before - now)) * s.time_step;
      before = now;
      dem.advance(1, {});
    }
    EXPECT_NEAR(0.5 * M_PI / crossing, omega, 1e-3 * omega) << length;
  }
}

namespace
{
struct Result
{
  Eigen::Matrix3Xd displacement, velocity;
  std::int64_t intact = 0, broken = 0;
  Eigen::Vector3d momentum_change;
};

/// A body that perturbations and drifts through the seam by 1.5 diameters along each axis.
Result perturb(const Packing &packing, Settings s, MPI_Comm comm, double speed)
{
  s.comm = comm;
  DemSide dem(s);
  const int steps = 400;
  Eigen::Vector3d drift = Eigen::Vector3d::Constant(1.5 * d / (steps * s.time_step));
  if (packing.dim == 2)
    drift[2] = 0.;
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
    for (int c = 0; c < packing.dim; ++c)
      p.velocity[c] = speed * noise(3 * p.index + c) + drift[c];
  start(dem, packing, particles);
  Result result;
  const auto momentum = [&]
  {
    const Particles all = dem.particles();
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int i = 0; i < all.n; ++i)
      sum += all.mass[i] * all.velocity.col(i);
    MPI_Allreduce(MPI_IN_PLACE, sum.data(), 3, MPI_DOUBLE, MPI_SUM, comm);
    return sum;
  };
  const Eigen::Vector3d before = momentum();
  dem.advance(steps, {});
  result.momentum_change = (momentum() - before) / before.norm();
  result.displacement = gather(dem, packing, Quantity::position, comm);
  for (int i = 0; i < packing.size(); ++i)
    result.displacement.col(i) = packing.displacement(i, result.displacement.col(i));
  result.velocity = gather(dem, packing, Quantity::velocity, comm);
  result.intact = dem.n_bonds_intact();
  result.broken = dem.n_bonds_broken();
  EXPECT_EQ(dem.left_domain().size(), 0u);
  return result;
}
} // namespace

// Ranks change only the order of sums, in 400 steps a hundred times round-off. Bonds go through the seam and across ranks
// without loss; pair forces cancel to round-off of the images' positions.
TEST(DemPeriodic, BodiesDriftThroughTheSeamOnAnyNumberOfRanks)
{
  for (const Packing &packing : {strip(16, 8), bar(12, 4)})
  {
    const Settings s = settings(packing);
    const Result alone = perturb(packing, s, MPI_COMM_SELF, 0.3), together = perturb(packing, s, MPI_COMM_WORLD, 0.3);
    EXPECT_EQ(alone.intact, static_cast<std::int64_t>(packing.bonds.size()));
    EXPECT_EQ(together.intact, alone.intact);
    EXPECT_EQ(alone.broken + together.broken, 0);
    EXPECT_LT(alone.momentum_change.norm(), 1e-12);
    EXPECT_LT(together.momentum_change.norm(), 1e-12);
    EXPECT_GT(alone.displacement.row(1).minCoeff(), 1.3 * d); // they went through
    EXPECT_LT((together.displacement - alone.displacement).cwiseAbs().maxCoeff(), 1e-9 * d);
    EXPECT_LT((together.velocity - alone.velocity).cwiseAbs().maxCoeff(), 1e-9 * alone.velocity.cwiseAbs().maxCoeff());
  }
}

TEST(DemPeriodic, BondsBreakOnceAtTheSeam)
{
  const Packing packing = strip(16, 8);
  Settings s = settings(packing);
  s.bond.R_n = 1e-3 * d * s.bond.k_n;
  s.bond.R_t = 3e-4 * d * s.bond.k_n;
  const Result alone = perturb(packing, s, MPI_COMM_SELF, 1.), together = perturb(packing, s, MPI_COMM_WORLD, 1.);
  for (const Result &result : {alone, together})
  {
    EXPECT_GT(result.broken, static_cast<std::int64_t>(packing.bonds.size() / 20));
    EXPECT_EQ(result.broken + result.intact, static_cast<std::int64_t>(packing.bonds.size()));
    EXPECT_LT(result.momentum_change.norm(), 1e-12);
  }
}

TEST(DemPeriodic, BoxesTooSmallForTheListsAreNamed)
{
  Packing packing = strip(16, 4);
  packing.positions.row(1) *= 0.5; // two particles high: a particle would see two images of its neighbours
  packing.upper[1] = packing.periodic[1] = 2. * d;
  try
  {
    DemSide dem(settings(packing));
    FAIL() << "no error";
  }
  catch (const std::invalid_argument &error)
  {
    EXPECT_NE(std::string(error.what()).find("particles: side y of the periodic box is 0.002 m long, it must be longer than"),
              std::string::npos)
      << error.what();
  }
}
