// SPDX-License-Identifier: GPL-2.0-or-later
// Particles from the store: bonds, stress they are born with, weights.
#include "dem_side/errors.h"
#include "tests/support/dem_test_packings.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

using namespace kerf::dem;
using namespace kerf::dem::test;

namespace
{
/// Uniform strain and a small uniform rotation.
const Eigen::Matrix3d gradient = (Eigen::Matrix3d() << 2e-4, 5e-5, 0., 1e-4, -1e-4, 0., 0., 0., 0.).finished();

std::vector<NewParticle> strained(const Packing &packing)
{
  auto particles = all_particles(packing);
  for (NewParticle &p : particles)
  {
    p.displacement = gradient * packing.positions.col(p.index);
    p.rotation[2] = 0.5 * (gradient(1, 0) - gradient(0, 1));
  }
  return particles;
}

bool inside(const Packing &packing, int i, double margin)
{
  const Eigen::Array3d x = packing.positions.col(i);
  const int dim = packing.dim;
  return (x > packing.lower.array() + margin).head(dim).all() && (x < packing.upper.array() - margin).head(dim).all();
}
} // namespace

TEST(DemInsertion, MakesTheStoredBonds)
{
  for (const Packing &packing : {triangular_lattice(20, 20, 5e-4), fcc_lattice(3, 5e-4)})
  {
    DemSide dem(settings(packing));
    start(dem, packing, all_particles(packing));
    EXPECT_EQ(dem.n_active(), packing.size());
    EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
    // At the stored places there is no force, though all particles touch.
    EXPECT_LT(gather(dem, packing, Quantity::force).norm(), 1e-10 * 1e9 * 1e-3);
  }
}

TEST(DemInsertion, TouchingPairsThatAreNotStoredAsBondedStayFree)
{
  Packing packing = triangular_lattice(20, 20, 5e-4);
  packing.bonds.resize(packing.bonds.size() / 2);
  DemSide dem(settings(packing));
  start(dem, packing, all_particles(packing));
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
}

TEST(DemInsertion, UniformStrainLeavesTheInsideInEquilibrium)
{
  for (const Packing &packing : {triangular_lattice(20, 20, 5e-4), fcc_lattice(4, 5e-4)})
  {
    const Settings s = settings(packing);
    DemSide dem(s);
    start(dem, packing, strained(packing));
    const Eigen::Matrix3Xd force = gather(dem, packing, Quantity::force), torque = gather(dem, packing, Quantity::torque);
    const double bond_force = s.bond.k_n * 1e-4 * packing.mean_diameter;
    double skin = 0.;
    int n = 0;
    for (int i = 0; i < packing.size(); ++i)
      if (inside(packing, i, 1.1 * packing.mean_diameter))
      {
        // A lattice is symmetric: forces of opposite bonds cancel to round-off of the positions (1e-16 of the sample).
        EXPECT_LT(force.col(i).norm(), 1e-9 * bond_force);
        // Moments vanish because the particles turn with the strain field's rotation; second order is 1e-4.
        EXPECT_LT(torque.col(i).norm(), 1e-3 * bond_force * packing.mean_diameter);
        ++n;
      }
      else
        skin = std::max(skin, force.col(i).norm());
    EXPECT_GT(n, packing.size() / 10);
    EXPECT_GT(skin, 0.1 * bond_force);
  }
}

// The torque on a particle is its weight times that without weights, whatever the weights of its partners; with weights of the
// bonds only, it would be some tenths of a bond's moment here.
TEST(DemInsertion, MomentsOfUniformStrainBalanceWithAnyWeights)
{
  for (const Packing &packing : {triangular_lattice(20, 20, 5e-4), fcc_lattice(4, 5e-4)})
  {
    const Settings s = settings(packing);
    DemSide dem(s);
    dem.insert(strained(packing));
    Eigen::VectorXd weight(packing.size());
    for (int i = 0; i < packing.size(); ++i)
      weight[i] = std::clamp(0.5 + noise(i), 0., 1.);
    dem.set_weights(weight);
    dem.setup({});
    const Eigen::Matrix3Xd force = gather(dem, packing, Quantity::force), torque = gather(dem, packing, Quantity::torque);
    const double bond_force = s.bond.k_n * 1e-4 * packing.mean_diameter;
    double largest_force = 0.;
    for (int i = 0; i < packing.size(); ++i)
      if (inside(packing, i, 1.1 * packing.mean_diameter))
      {
        largest_force = std::max(largest_force, force.col(i).norm());
        EXPECT_LT(torque.col(i).norm(), 1e-3 * bond_force * packing.mean_diameter); // second order, see above
      }
    EXPECT_GT(largest_force, 0.1 * bond_force); // forces do not balance
  }
}

TEST(DemInsertion, CarriesTheStressOfTheProjection)
{
  Packing packing = two_particles(0.4e-3, 0.6e-3, 1.05e-3); // stored with a gap
  const Settings s = settings(packing);
  DemSide dem(s);
  auto particles = all_particles(packing);
  const double u = 1e-7, across = 3e-8, turn = 1e-5;
  particles[1].displacement = Eigen::Vector3d(u, across, 0.);
  for (NewParticle &p : particles)
    p.rotation = Eigen::Vector3d(0., 0., turn);
  start(dem, packing, particles);
  dem.setup({}); // must not change anything
  const Eigen::Matrix3Xd force = gather(dem, packing, Quantity::force);
  // Shear is what is left after the rotation that comes with the particles. Second order: 1e-4 of the force.
  EXPECT_NEAR(force(0, 0), s.bond.k_n * u, 1e-3 * s.bond.k_n * u);
  EXPECT_NEAR(force(1, 0), s.bond.k_t * (across - turn * 1.05e-3), 1e-3 * s.bond.k_n * u);
  EXPECT_NEAR((force.col(0) + force.col(1)).norm(), 0., 1e-9 * s.bond.k_n * u);
}

TEST(DemInsertion, TwoBatchesEqualOne)
{
  for (const Packing &packing : {triangular_lattice(14, 14, 5e-4), fcc_lattice(3, 5e-4)})
  {
    const Settings s = settings(packing);
    DemSide once(s), twice(s);
    const auto particles = strained(packing);
    std::vector<NewParticle> first, second;
    for (const NewParticle &p : particles)
      (p.index % 3 != 0 ? first : second).push_back(p);
    start(once, packing, particles);
    start(twice, packing, first);
    EXPECT_LT(twice.n_bonds_intact(), once.n_bonds_intact());
    start(twice, packing, second);
    EXPECT_EQ(twice.n_bonds_intact(), once.n_bonds_intact());
    const Eigen::Matrix3Xd a = gather(once, packing, Quantity::force), b = gather(twice, packing, Quantity::force);
    EXPECT_LT((a - b).norm(), 1e-12 * s.bond.k_n * packing.mean_diameter);
    EXPECT_GT(a.norm(), 1e-4 * s.bond.k_n * packing.mean_diameter);
  }
}

TEST(DemInsertion, LaterInsertionKeepsTheStateOfTheFirstBonds)
{
  // The lower half moves and turns before the upper half comes; its forces must not change by that.
  const Packing packing = triangular_lattice(10, 20, 5e-4);
  const Settings s = settings(packing);
  DemSide dem(s);
  std::vector<NewParticle> first, second;
  for (NewParticle p : all_particles(packing))
  {
    for (int c = 0; c < 2; ++c)
      p.velocity[c] = 0.1 * noise(3 * p.index + c);
    p.angular_velocity[2] = 100. * noise(3 * p.index + 2);
    (p.index < 100 ? first : second).push_back(p);
  }
  start(dem, packing, first);
  dem.advance(100, {});
  const Eigen::Matrix3Xd before = gather(dem, packing, Quantity::force);
  start(dem, packing, second);
  const Eigen::Matrix3Xd after = gather(dem, packing, Quantity::force);
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()));
  const double scale = before.norm();
  for (int i = 0; i < 90; ++i) // the row at the seam got new bonds
    EXPECT_LT((before.col(i) - after.col(i)).norm(), 1e-10 * scale);
}

TEST(DemInsertion, BrokenBondsDoNotHealWhenMoreParticlesCome)
{
  const Packing packing = triangular_lattice(10, 20, 5e-4);
  Settings s = settings(packing);
  s.bond.R_n = s.bond.R_t = 1e-4 * s.bond.k_n * packing.mean_diameter;
  DemSide dem(s);
  std::vector<NewParticle> first, second;
  for (NewParticle p : all_particles(packing))
  {
    if (p.index < 100)
      for (int c = 0; c < 2; ++c)
        p.velocity[c] = 0.5 * noise(3 * p.index + c);
    (p.index < 100 ? first : second).push_back(p);
  }
  start(dem, packing, first);
  dem.advance(100, {});
  const std::int64_t broken = dem.n_bonds_broken();
  EXPECT_GT(broken, 10);
  start(dem, packing, second);
  EXPECT_EQ(dem.n_bonds_broken(), broken);
  EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size()) - broken);
  double ends = 0.; // damage is kept by particle
  const auto damage = dem.damage();
  const Particles p = dem.particles();
  for (int i = 0; i < p.n; ++i)
    for (const auto &b : packing.bonds)
      ends += (b[0] == p.index[i] || b[1] == p.index[i]) * damage[i];
  MPI_Allreduce(MPI_IN_PLACE, &ends, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  EXPECT_NEAR(ends, 2. * broken, 1e-9);
}

// The upper half is put in a tenth of a diameter too low. Its bonds to the lower one are born broken, or the store has none:
// nothing pushes. Bonds that are born broken count as broken.
TEST(DemInsertion, ParticlesPutIntoOthersStartWithoutForce)
{
  for (const bool bonded : {true, false})
  {
    Packing packing = triangular_lattice(10, 20, 5e-4);
    const auto crosses_seam = [](const auto &bond) { return (bond[0] < 100) != (bond[1] < 100); };
    std::vector<StoredPair> seam;
    std::copy_if(packing.bonds.begin(), packing.bonds.end(), std::back_inserter(seam), crosses_seam);
    if (!bonded)
    {
      packing.bonds.erase(std::remove_if(packing.bonds.begin(), packing.bonds.end(), crosses_seam), packing.bonds.end());
      seam.clear();
    }
    const Settings s = settings(packing);
    DemSide dem(s);
    std::vector<NewParticle> first, second;
    std::unordered_map<int, NewParticle> expected;
    for (NewParticle p : all_particles(packing))
    {
      if (p.index < 100)
        expected[p.index] = p;
      else
        p.displacement[1] = -0.1 * packing.mean_diameter;
      (p.index < 100 ? first : second).push_back(p);
    }
    start(dem, packing, first);
    EXPECT_TRUE(dem.misfitting_bonds(second, expected).empty()); // the lower half is where it should be
    dem.insert(second, seam);
    dem.set_weights(Eigen::VectorXd::Ones(packing.size()));
    dem.setup({});
    EXPECT_EQ(dem.n_bonds_broken(), static_cast<std::int64_t>(seam.size()));
    EXPECT_EQ(dem.n_bonds_intact(), static_cast<std::int64_t>(packing.bonds.size() - seam.size()));
    const double push = s.bond.k_n * 0.1 * packing.mean_diameter;
    EXPECT_LT(gather(dem, packing, Quantity::force).norm(), 1e-10 * push);
    EXPECT_LT(dem.energies().elastic, 1e-10 * push * packing.mean_diameter);
    dem.advance(10, {});
    EXPECT_LT(gather(dem, packing, Quantity::force).norm(), 1e-10 * push);
    for (const BrokenBond &bond : dem.broken_bonds())
      EXPECT_TRUE(bond.at_birth);
  }
}

// A partner that turns by more than R_t/(k_t d0 / 2) is no longer where the field expects it, one that turns by less is. The
// bond of equal discs shears by half of its length times the rotation.
TEST(DemInsertion, FindsPartnersThatHaveTurnedAway)
{
  const Packing packing = two_particles(5e-4, 5e-4, 1e-3);
  Settings s = settings(packing);
  s.bond.R_n = s.bond.R_t = 1e-4 * s.bond.k_n * packing.mean_diameter;
  const double limit = s.bond.R_t / (0.5 * s.bond.k_t * 1e-3);
  for (const double turn : {0.99 * limit, 1.01 * limit})
  {
    DemSide dem(s);
    NewParticle partner = all_particles(packing)[0], fresh = all_particles(packing)[1];
    const NewParticle expected = partner;
    partner.rotation[2] = turn;
    start(dem, packing, {partner});
    int found = static_cast<int>(dem.misfitting_bonds({fresh}, {{0, expected}}).size());
    MPI_Allreduce(MPI_IN_PLACE, &found, 1, MPI_INT, MPI_SUM, MPI_COMM_WORLD);
    EXPECT_EQ(found, turn > limit);
  }
}

TEST(DemInsertion, HalfWeightHalvesForcesMassesAndEnergies)
{
  const Packing packing = triangular_lattice(10, 10, 5e-4);
  const Settings s = settings(packing);
  DemSide dem(s);
  auto particles = strained(packing);
  for (NewParticle &p : particles)
    p.velocity = Eigen::Vector3d(1., 2., 0.), p.angular_velocity[2] = 1e3;
  start(dem, packing, particles);
  const Eigen::Matrix3Xd full = gather(dem, packing, Quantity::force);
  const Energies full_energy = dem.energies();
  dem.set_weights(Eigen::VectorXd::Constant(packing.size(), 0.5));
  dem.setup({});
  const Eigen::Matrix3Xd half = gather(dem, packing, Quantity::force);
  EXPECT_LT((half - 0.5 * full).norm(), 1e-14 * full.norm());
  EXPECT_NEAR(dem.energies().kinetic, 0.5 * full_energy.kinetic, 1e-14 * full_energy.kinetic);
  EXPECT_NEAR(dem.energies().elastic, 0.5 * full_energy.elastic, 1e-14 * full_energy.elastic);
  const Particles p = dem.particles();
  for (int i = 0; i < p.n; ++i)
  {
    EXPECT_DOUBLE_EQ(p.mass[i], 0.5 * s.density * M_PI * 0.25e-6);
    EXPECT_EQ(p.weight[i], 0.5);
    EXPECT_EQ(p.radius[i], 5e-4);
  }
  // Strength is a matter of the unweighted force.
  for (const ActiveBond &b : dem.bonds())
    EXPECT_LT(std::abs(b.normal_force), 3e-4 * s.bond.k_n * packing.mean_diameter);
}

TEST(DemInsertion, MassIsTheMeanWeightOfTheBondsToActivePartners)
{
  const Packing packing = triangular_lattice(8, 8, 5e-4);
  const Settings s = settings(packing);
  DemSide dem(s);
  Eigen::VectorXd weight(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    weight[i] = 0.55 + 0.45 * noise(i);
  std::vector<NewParticle> some;
  for (const NewParticle &p : all_particles(packing))
    if (p.index < 40 || p.index == 63) // the last one has no active partner
      some.push_back(p);
  dem.insert(some);
  dem.set_weights(weight);
  dem.setup({});
  std::vector<double> sum(packing.size(), 0.), count(packing.size(), 0.);
  for (const auto &[a, b] : packing.bonds)
    if (a < 40 && b < 40)
      for (const int i : {a, b})
      {
        sum[i] += 0.5 * (weight[a] + weight[b]);
        count[i] += 1.;
      }
  const Particles p = dem.particles();
  for (int i = 0; i < p.n; ++i)
  {
    const int k = p.index[i];
    const double mean = count[k] > 0. ? sum[k] / count[k] : weight[k];
    EXPECT_EQ(p.weight[i], weight[k]);
    EXPECT_NEAR(p.mass[i], mean * s.density * M_PI * 0.25e-6, 1e-14 * p.mass[i]);
  }
}

TEST(DemInsertion, RefusesBadParticles)
{
  const Packing packing = triangular_lattice(6, 6, 5e-4);
  DemSide dem(settings(packing));
  const auto one = [](int index, double x = 0.)
  {
    NewParticle p;
    p.index = index;
    p.displacement[0] = x;
    return std::vector<NewParticle>{p};
  };
  EXPECT_THROW(dem.insert(one(-1)), std::logic_error);
  EXPECT_THROW(dem.insert(one(36)), std::logic_error);
  EXPECT_THROW(dem.insert(one(0, 1.)), Unstable);
  EXPECT_THROW(dem.insert(one(0, std::nan(""))), Unstable);
  auto twice = one(3);
  twice.push_back(twice[0]);
  EXPECT_THROW(dem.insert(twice), std::logic_error);
  dem.insert(one(3));
  EXPECT_THROW(dem.insert(one(3)), std::logic_error);
  EXPECT_THROW(dem.set_weights(Eigen::VectorXd::Ones(35)), std::logic_error);
  EXPECT_THROW(dem.set_weights(Eigen::VectorXd::Zero(36)), std::logic_error);
  dem.insert({}); // nothing to do is fine
  dem.setup({});
  EXPECT_EQ(dem.n_active(), 1);
}

TEST(DemInsertion, BondsThatCannotBeMadeAreAnError)
{
  const Packing packing = two_particles(0.5e-3, 0.5e-3, 1e-3);
  DemSide dem(settings(packing));
  auto particles = all_particles(packing);
  particles[1].displacement[0] = 1e-3; // twice the stored distance
  dem.insert(particles);
  dem.set_weights(Eigen::VectorXd::Ones(2));
  EXPECT_THROW(dem.setup({}), Unstable);
}
