// SPDX-License-Identifier: GPL-2.0-or-later
// Bonded lattices against closed answers: waves, first breaks, bending.
#include "tests/support/dem_stiffness.h"
#include "tests/support/dem_test_packings.h"

#include <gtest/gtest.h>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
constexpr double r = 5e-4, d = 2. * r;
const double root3 = std::sqrt(3.);

double mass_of(const Packing &packing)
{
  return settings(packing).density * packing.volume(0);
}

int middle_particle(const Packing &packing)
{
  int nearest = 0;
  (packing.positions.colwise() - 0.5 * (packing.lower + packing.upper)).colwise().squaredNorm().minCoeff(&nearest);
  return nearest;
}

/// Angular frequency of the standing wave u = A e cos(q (x - x0)) about the middle of a block, from three quarters of a period:
/// too short for what starts at the free surfaces.
double wave_frequency(const Packing &packing, const Eigen::Vector3d &direction, double wave_number, double expected)
{
  Settings s = settings(packing);
  constexpr int steps_a_period = 400;
  s.time_step = 2. * M_PI / expected / steps_a_period;
  const double amplitude = 1e-7 * packing.mean_diameter; // linear to 1e-7, positions to 1e-9 of it
  const int middle = middle_particle(packing);
  const Eigen::Vector3d centre = packing.positions.col(middle);
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
    p.displacement = amplitude * std::cos(wave_number * direction.dot(packing.positions.col(p.index) - centre)) * direction;
  DemSide dem(s);
  double before = amplitude, crossing = 0.;
  std::vector<double> crossings;
  int n = 0;
  const ForceHook monitor = [&](Phase phase, Particles &all)
  {
    if (phase != Phase::step)
      return;
    ++n;
    for (int i = 0; i < all.n; ++i)
      if (all.index[i] == middle)
      {
        const double now = direction.dot(all.position.col(i) - centre);
        if (now * before < 0.)
          crossings.push_back((n - 1 + before / (before - now)) * s.time_step);
        before = now;
      }
  };
  start(dem, packing, particles, monitor);
  dem.advance(static_cast<int>(0.8 * steps_a_period), monitor);
  EXPECT_EQ(crossings.size(), 2u);
  if (crossings.size() == 2)
    crossing = crossings[1]; // 3/4 of the period
  return 1.5 * M_PI / crossing;
}

// Half a block over the wave's speed is longer than 3/4 of a period for waves up to half a block; 0.1 % is asked for, central
// differences take (omega dt)^2 / 24 = 1e-5 of it.
constexpr double dispersion_tolerance = 1e-3;
} // namespace

TEST(Dispersion, TriangularLatticeAlongItsRows)
{
  const Packing packing = triangular_lattice(48, 56, r);
  const BondParameters bond = settings(packing).bond;
  for (const double length : {3., 5., 10.})
  {
    const double q = 2. * M_PI / (length * d);
    const double square = 2. * bond.k_n * (1. - std::cos(q * d)) + (bond.k_n + 3. * bond.k_t) * (1. - std::cos(0.5 * q * d));
    const double omega = std::sqrt(square / mass_of(packing));
    EXPECT_NEAR(wave_frequency(packing, Eigen::Vector3d::UnitX(), q, omega), omega, dispersion_tolerance * omega) << length;
  }
}

TEST(Dispersion, TriangularLatticeAcrossItsRows)
{
  const Packing packing = triangular_lattice(48, 56, r);
  const BondParameters bond = settings(packing).bond;
  for (const double length : {3., 5., 10.})
  {
    const double q = 2. * M_PI / (length * d);
    const double omega = std::sqrt((3. * bond.k_n + bond.k_t) * (1. - std::cos(0.5 * root3 * q * d)) / mass_of(packing));
    EXPECT_NEAR(wave_frequency(packing, Eigen::Vector3d::UnitY(), q, omega), omega, dispersion_tolerance * omega) << length;
  }
}

TEST(Dispersion, FaceCentredCubicAlongACubeAxis)
{
  // Four of the twelve bonds lead to the next plane, a side/2 away, under 45 degrees.
  const Packing packing = fcc_lattice(9, r);
  const BondParameters bond = settings(packing).bond;
  const double side = std::sqrt(2.) * d;
  for (const double length : {3., 4., 5.})
  {
    const double q = 2. * M_PI / (length * d);
    const double omega = std::sqrt(4. * (bond.k_n + bond.k_t) * (1. - std::cos(0.5 * q * side)) / mass_of(packing));
    EXPECT_NEAR(wave_frequency(packing, Eigen::Vector3d::UnitX(), q, omega), omega, dispersion_tolerance * omega) << length;
  }
}

namespace
{
/// Bonds along the rows and inclined ones that break in the first step when the lattice is under the stress @p fraction times
/// the strength. @param strength stress of the first break over R / d; @param axis of the uniaxial stress
struct FirstBreak
{
  double along = 0., inclined = 0.; ///< shares of the bonds
};
FirstBreak first_break(int axis, double stress_over_R, bool shear, double fraction)
{
  const Packing packing = triangular_lattice(12, 12, r);
  Settings s = settings(packing);
  constexpr double strength = 1e-5 * d; // bond stretch at failure: linear to 1e-5
  (shear ? s.bond.R_t : s.bond.R_n) = strength * (shear ? s.bond.k_t : s.bond.k_n);
  const double R = shear ? s.bond.R_t : s.bond.R_n;
  // Plane strain of the lattice: C11, C12 for any two axes.
  const double C11 = 0.25 * root3 * (3. * s.bond.k_n + s.bond.k_t), C12 = 0.25 * root3 * (s.bond.k_n - s.bond.k_t);
  const double stress = fraction * stress_over_R * R / d;
  const double strain = stress / (C11 - C12 * C12 / C11);
  s.time_step *= 1e-3; // only to have the bonds looked at
  DemSide dem(s);
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
    for (int c = 0; c < 2; ++c)
      p.displacement[c] = (c == axis ? strain : -C12 / C11 * strain) * packing.positions(c, p.index);
  start(dem, packing, particles);
  dem.advance(1, {});
  FirstBreak result;
  double n_along = 0., n_inclined = 0.;
  const auto is_along = [&](int a, int b) { return packing.positions(1, a) == packing.positions(1, b); };
  for (const auto &bond : packing.bonds)
    ++(is_along(bond[0], bond[1]) ? n_along : n_inclined);
  for (const BrokenBond &bond : dem.broken_bonds())
  {
    EXPECT_EQ(bond.shear, shear);
    ++(is_along(bond.first, bond.second) ? result.along : result.inclined);
  }
  result.along /= n_along;
  result.inclined /= n_inclined;
  return result;
}

/// Nothing breaks just below; all bonds of the weakest direction break just above. 0.1 %: strains of 1e-5 are linear to that.
void expect_first_break(int axis, double stress_over_R, bool shear, bool along)
{
  const FirstBreak below = first_break(axis, stress_over_R, shear, 0.999);
  EXPECT_EQ(below.along, 0.);
  EXPECT_EQ(below.inclined, 0.);
  const FirstBreak above = first_break(axis, stress_over_R, shear, 1.001);
  EXPECT_EQ(above.along, along ? 1. : 0.);
  EXPECT_EQ(above.inclined, along ? 0. : 1.);
}
} // namespace

TEST(FirstBreak, TriangularLattice)
{
  const BondParameters bond = settings(triangular_lattice(2, 2, r)).bond;
  const double k_n = bond.k_n, k_t = bond.k_t;
  expect_first_break(1, 2. * root3 * (k_n + k_t) / (2. * k_n + k_t), false, false); // tension across the rows
  expect_first_break(0, 2. * root3 * (k_n + k_t) / (3. * k_n + k_t), false, true);  // tension along the rows
  expect_first_break(1, -2. * root3 * (k_n + k_t) / (k_n - k_t), false, true);      // compression across splits the rows
  expect_first_break(1, 2. * (k_n + k_t) / k_t, true, false);                       // inclined bonds in shear
  expect_first_break(0, 2. * (k_n + k_t) / k_t, true, false);
}

TEST(Cantilever, BendsAsTheStaticSolve)
{
  // A beam of five rows cut out of the lattice, its first column held, the force on its last one.
  constexpr int columns = 16, rows = 5;
  const Packing packing = triangular_lattice(columns, rows, r);
  Settings s = settings(packing);
  s.time_step *= 4.; // 0.8 of the stable step
  s.local_damping = 0.3;
  s.bond.damping = 0.05;
  const auto held = [](int i) { return i % columns == 0; };
  const auto loaded = [](int i) { return i % columns == columns - 1; };
  const double force = 1e-7 * d * s.bond.k_n; // deflections of 1e-5 d: linear to 1e-6
  const Network network = linear_network(packing, s.bond, s.density);

  std::vector<int> free;
  for (int i = 0; i < packing.size(); ++i)
    for (int c = 0; c < 3 && !held(i); ++c)
      free.push_back(3 * i + c);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * packing.size());
  for (int i = 0; i < packing.size(); ++i)
    if (loaded(i))
      load[3 * i + 1] = -force / rows;
  const Eigen::MatrixXd K = network.stiffness(free, free);
  const Eigen::VectorXd f = load(free);
  const Eigen::VectorXd u = K.llt().solve(f);
  Eigen::VectorXd displacement = Eigen::VectorXd::Zero(3 * packing.size());
  displacement(free) = u;

  DemSide dem(s);
  const ForceHook hook = [&](Phase, Particles &all)
  {
    for (int i = 0; i < all.n; ++i)
    {
      if (loaded(all.index[i]))
        all.force(1, i) -= force / rows;
      if (held(all.index[i]))
      {
        all.force.col(i).setZero();
        all.torque.col(i).setZero();
        all.velocity.col(i).setZero();
        all.angular_velocity.col(i).setZero();
      }
    }
  };
  start(dem, packing, all_particles(packing), hook);
  dem.advance(30000, hook);
  const Eigen::Matrix3Xd moved = gather(dem, packing, Quantity::position) - packing.positions;
  double largest = 0., difference = 0.;
  for (int i = 0; i < packing.size(); ++i)
  {
    largest = std::max(largest, displacement.segment<2>(3 * i).norm());
    difference = std::max(difference, (moved.col(i).head<2>() - displacement.segment<2>(3 * i)).norm());
  }
  // Geometry of deflections of 1e-5 d, and what is left of the vibration (below the elastic energy by 1e-10).
  EXPECT_LT(difference, 1e-4 * largest);
  EXPECT_LT(dem.energies().kinetic, 1e-10 * dem.energies().elastic);
}
