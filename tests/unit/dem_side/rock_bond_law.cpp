// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond/rock_bond_law.h"

#include <gtest/gtest.h>

using namespace kerf::dem;

namespace
{
constexpr double d0 = 1.1e-3, r1 = 0.4e-3, r2 = 0.7e-3;
constexpr double epsilon = 1e-15;

BondParameters rock()
{
  BondParameters bond;
  bond.k_n = 2e9;
  bond.k_t = 0.5e9;
  bond.R_n = 3e3;
  bond.R_t = 5e3;
  bond.friction = 0.6;
  return bond;
}

/// Two bonded particles anywhere: positions and rotations, both free.
template <int dim>
struct State
{
  law::Vector<dim> x1 = law::Vector<dim>::Zero(), x2 = law::Vector<dim>::Zero(), normal = law::Vector<dim>::Unit(0);
  Eigen::Quaterniond q1 = Eigen::Quaterniond::Identity(), q2 = Eigen::Quaterniond::Identity();

  State() { x2[0] = d0; }
  static law::Vector<dim> turned(const Eigen::Quaterniond &q, const law::Vector<dim> &a)
  {
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    b.template head<dim>() = a;
    return (q * b).template head<dim>();
  }
  law::Pair<dim> pair() const { return law::make_pair<dim>(x1, x2, r1, r2); }
  law::BondStrain<dim> strain() const { return law::bond_strain<dim>(pair(), d0, turned(q1, normal), turned(q2, normal)); }
  law::PairLoad<dim> load(const BondParameters &bond) const
  {
    return law::bond_load<dim>(pair(), strain(), d0, turned(q1, normal), turned(q2, normal), bond);
  }
};

template <int dim>
Eigen::Quaterniond rotation(int axis, double angle)
{
  return Eigen::Quaterniond(Eigen::AngleAxisd(angle, dim == 2 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::Unit(axis)));
}

/// A strained and turned state without any symmetry.
template <int dim>
State<dim> general_state()
{
  State<dim> s;
  s.normal = law::Vector<dim>::LinSpaced(0.3, 0.9).normalized();
  s.x2 = d0 * s.normal * 1.02;
  s.x2[1] += 0.03 * d0;
  s.q1 = rotation<dim>(0, 0.04) * rotation<dim>(1, -0.03) * rotation<dim>(2, 0.05);
  s.q2 = rotation<dim>(2, -0.02) * rotation<dim>(1, 0.06) * rotation<dim>(0, -0.01);
  return s;
}

constexpr double rolling = 0.2;

template <int dim>
double energy(const State<dim> &s, const BondParameters &bond)
{
  return law::bond_energy<dim>(s.strain(), bond) +
         law::rolling_energy<dim>(rolling, d0, s.turned(s.q1, s.normal), s.turned(s.q2, s.normal), bond);
}

/// Force and torques against central differences of the potential.
template <int dim>
void expect_derivative_of_energy()
{
  const BondParameters bond = rock();
  const State<dim> s = general_state<dim>();
  auto load = s.load(bond);
  const auto torque = law::rolling_torque<dim>(rolling, d0, s.turned(s.q1, s.normal), s.turned(s.q2, s.normal), bond);
  load.torque_first += torque;
  load.torque_second -= torque;
  const double scale = bond.k_n * d0;
  const double h = 1e-6; // error of the difference h^2 plus 1e-16 / h, relative: 1e-9 is safe
  for (int c = 0; c < dim; ++c)
  {
    State<dim> a = s, b = s;
    a.x1[c] += h * d0, b.x1[c] -= h * d0;
    EXPECT_NEAR(-(energy(a, bond) - energy(b, bond)) / (2. * h * d0), load.force[c], 1e-9 * scale);
    a = b = s;
    a.x2[c] += h * d0, b.x2[c] -= h * d0;
    EXPECT_NEAR((energy(a, bond) - energy(b, bond)) / (2. * h * d0), load.force[c], 1e-9 * scale);
  }
  for (int axis = 0; axis < (dim == 2 ? 1 : 3); ++axis)
  {
    State<dim> a = s, b = s;
    a.q1 = rotation<dim>(axis, h) * s.q1, b.q1 = rotation<dim>(axis, -h) * s.q1;
    EXPECT_NEAR(-(energy(a, bond) - energy(b, bond)) / (2. * h), load.torque_first[axis], 1e-9 * scale * d0);
    a = b = s;
    a.q2 = rotation<dim>(axis, h) * s.q2, b.q2 = rotation<dim>(axis, -h) * s.q2;
    EXPECT_NEAR(-(energy(a, bond) - energy(b, bond)) / (2. * h), load.torque_second[axis], 1e-9 * scale * d0);
  }
}

/// Four states at once must be what each of them is alone.
template <int dim>
void expect_lanes_like_single_bonds()
{
  BondParameters bond = rock();
  bond.shear_friction = 0.3;
  bond.R_n = 0.01 * bond.k_n * d0; // of the order of the forces: some fail in tension, some in shear, some not
  bond.R_t = 0.01 * bond.k_t * d0;
  law::Vector<dim, SimdPack> x1, x2, n1, n2;
  State<dim> states[SimdPack::size];
  const double stretch[] = {1.03, 1.001, 0.97, 1.002}, twist[] = {0., 0.05, 0.05, 1e-3};
  for (int lane = 0; lane < SimdPack::size; ++lane)
  {
    State<dim> &s = states[lane];
    s = general_state<dim>();
    s.x2 = d0 * s.normal * stretch[lane];
    s.q1 = rotation<dim>(0, 0.3);
    s.q2 = rotation<dim>(2, twist[lane]) * s.q1;
    s.x2 = State<dim>::turned(s.q1, s.x2);
    const law::Vector<dim> first = State<dim>::turned(s.q1, s.normal), second = State<dim>::turned(s.q2, s.normal);
    for (int c = 0; c < dim; ++c)
    {
      x1[c].set(lane, s.x1[c]), x2[c].set(lane, s.x2[c]);
      n1[c].set(lane, first[c]), n2[c].set(lane, second[c]);
    }
  }
  const auto pair = law::make_pair<dim, SimdPack>(x1, x2, SimdPack(r1), SimdPack(r2));
  const auto strain = law::bond_strain<dim, SimdPack>(pair, SimdPack(d0), n1, n2);
  const auto load = law::bond_load<dim, SimdPack>(pair, strain, SimdPack(d0), n1, n2, bond);
  const auto tension = law::fails_in_tension(strain, bond), shear = law::fails_in_shear(strain, bond);
  bool seen[3] = {};
  for (int lane = 0; lane < SimdPack::size; ++lane)
  {
    const State<dim> &s = states[lane];
    const auto one = s.load(bond);
    for (int c = 0; c < dim; ++c)
      EXPECT_NEAR(load.force[c][lane], one.force[c], 10. * epsilon * bond.k_n * d0);
    for (int c = 0; c < one.torque_first.size(); ++c)
    {
      EXPECT_NEAR(load.torque_first[c][lane], one.torque_first[c], 10. * epsilon * bond.k_n * d0 * d0);
      EXPECT_NEAR(load.torque_second[c][lane], one.torque_second[c], 10. * epsilon * bond.k_n * d0 * d0);
    }
    const law::Failure failure = law::bond_failure<dim>(s.strain(), bond);
    EXPECT_EQ(tension[lane] ? law::Failure::tension : shear[lane] ? law::Failure::shear : law::Failure::none, failure);
    seen[static_cast<int>(failure)] = true;
  }
  EXPECT_TRUE(seen[0] && seen[1] && seen[2]);
}

template <int dim>
void expect_balance_of_moments()
{
  const State<dim> s = general_state<dim>();
  const auto load = s.load(rock());
  const law::Spin<dim> moment =
    law::cross(s.x1, load.force) - law::cross(s.x2, load.force) + load.torque_first + load.torque_second;
  EXPECT_GT(load.torque_first.norm(), 1e-3 * rock().k_t * d0 * d0); // the state is a loaded one
  EXPECT_LT(moment.norm(), 4. * epsilon * rock().k_n * d0 * d0);
}
} // namespace

TEST(RockBondLaw, NormalForceIsProportionalToElongation)
{
  const BondParameters bond = rock();
  for (const double u : {-1e-3, -1e-6, 1e-6, 1e-3})
  {
    State<2> s;
    s.x2[0] += u * d0;
    const auto load = s.load(bond);
    EXPECT_NEAR(load.force.x(), bond.k_n * u * d0, 4. * epsilon * bond.k_n * d0);
    EXPECT_EQ(load.force.y(), 0.);
    EXPECT_EQ(load.torque_first[0], 0.);
  }
}

TEST(RockBondLaw, ShearForceIsProportionalToDisplacementAcross)
{
  const BondParameters bond = rock();
  for (const double u : {1e-5, -1e-4})
  {
    State<2> s;
    s.x2[1] += u * d0;
    const auto load = s.load(bond);
    // The pair turns by u: second order differences from the linear law.
    EXPECT_NEAR(load.force.y(), bond.k_t * u * d0, 3. * u * u * bond.k_n * d0);
    EXPECT_NEAR(load.torque_first[0], r1 * bond.k_t * u * d0, 3. * u * u * bond.k_t * d0 * d0);
    EXPECT_NEAR(load.torque_second[0], r2 * bond.k_t * u * d0, 3. * u * u * bond.k_t * d0 * d0);
  }
}

TEST(RockBondLaw, RollingParticlesShearTheBondByTheirBranches)
{
  State<2> s;
  const double angle = 1e-5;
  s.q1 = rotation<2>(0, angle);
  // The first particle's surface moves up by its branch: the second one is left behind.
  EXPECT_NEAR(s.strain().shear.y(), -angle * d0 * r1 / (r1 + r2), angle * angle * d0);
  s.q1 = Eigen::Quaterniond::Identity(), s.q2 = rotation<2>(0, angle);
  EXPECT_NEAR(s.strain().shear.y(), -angle * d0 * r2 / (r1 + r2), angle * angle * d0);
}

TEST(RockBondLaw, LoadIsTheDerivativeOfTheEnergy)
{
  expect_derivative_of_energy<2>();
  expect_derivative_of_energy<3>();
}

TEST(RockBondLaw, SeveralBondsAtOnceAreLikeSingleOnes)
{
  expect_lanes_like_single_bonds<2>();
  expect_lanes_like_single_bonds<3>();
}

TEST(RockBondLaw, PairBalancesMoments)
{
  expect_balance_of_moments<2>();
  expect_balance_of_moments<3>();
}

TEST(RockBondLaw, RigidMotionOfUnequalParticlesGivesNoForce)
{
  State<3> s;
  const Eigen::Quaterniond q(Eigen::AngleAxisd(2.1, Eigen::Vector3d(1., -2., .5).normalized()));
  s.x1 = Eigen::Vector3d(1e-3, 2e-3, -3e-3);
  s.x2 = s.x1 + q * Eigen::Vector3d(d0, 0., 0.);
  s.q1 = s.q2 = q;
  const auto load = s.load(rock());
  EXPECT_LT(load.force.norm(), 10. * epsilon * rock().k_n * d0);
  EXPECT_LT(load.torque_first.norm(), 10. * epsilon * rock().k_n * d0 * d0);
}

TEST(RockBondLaw, FailsAtTheStrengths)
{
  const BondParameters bond = rock();
  const auto failure = [&bond](double elongation, double across)
  {
    law::BondStrain<2> strain{elongation, Eigen::Vector2d(0., across), 1.};
    return law::bond_failure<2>(strain, bond);
  };
  const double u_n = bond.R_n / bond.k_n, u_t = bond.R_t / bond.k_t, more = 1. + 1e-12, less = 1. - 1e-12;
  EXPECT_EQ(failure(less * u_n, 0.), law::Failure::none);
  EXPECT_EQ(failure(more * u_n, 0.), law::Failure::tension);
  EXPECT_EQ(failure(0., less * u_t), law::Failure::none);
  EXPECT_EQ(failure(0., -less * u_t), law::Failure::none);
  EXPECT_EQ(failure(0., more * u_t), law::Failure::shear);
  EXPECT_EQ(failure(0., -more * u_t), law::Failure::shear);
  EXPECT_EQ(failure(less * u_n, less * u_t), law::Failure::none); // no interaction of the two
}

TEST(RockBondLaw, CompressionAloneNeverBreaks)
{
  for (const double overlap : {1., 10., 1000.})
  {
    law::BondStrain<2> strain{-overlap * rock().R_n / rock().k_n, Eigen::Vector2d::Zero(), 1.};
    EXPECT_EQ(law::bond_failure<2>(strain, rock()), law::Failure::none);
  }
}

TEST(RockBondLaw, CompressionRaisesTheShearStrengthByInternalFriction)
{
  BondParameters bond = rock();
  bond.shear_friction = 0.8;
  const double more = 1. + 1e-12, less = 1. - 1e-12;
  const auto failure = [&bond](double compression, double shear_force)
  {
    law::BondStrain<3> strain{-compression / bond.k_n, Eigen::Vector3d(0., 0., shear_force / bond.k_t), 1.};
    return law::bond_failure<3>(strain, bond);
  };
  for (const double compression : {0., 1e3, 1e5})
  {
    const double strength = bond.R_t + 0.8 * compression;
    EXPECT_EQ(failure(compression, less * strength), law::Failure::none);
    EXPECT_EQ(failure(compression, -less * strength), law::Failure::none);
    EXPECT_EQ(failure(compression, more * strength), law::Failure::shear);
  }
  // Tension leaves the cohesion as it is.
  EXPECT_EQ(failure(-0.9 * bond.R_n, less * bond.R_t), law::Failure::none);
  EXPECT_EQ(failure(-0.9 * bond.R_n, more * bond.R_t), law::Failure::shear);
}

TEST(RockBondLaw, EnergyAtFailureIsHalfStrengthSquaredOverStiffness)
{
  const BondParameters bond = rock();
  law::BondStrain<2> tension{bond.R_n / bond.k_n, Eigen::Vector2d::Zero(), 1.};
  EXPECT_NEAR(law::bond_energy<2>(tension, bond), bond.R_n * bond.R_n / (2. * bond.k_n), 1e-12);
  law::BondStrain<2> shear{0., Eigen::Vector2d(0., bond.R_t / bond.k_t), 1.};
  EXPECT_NEAR(law::bond_energy<2>(shear, bond), bond.R_t * bond.R_t / (2. * bond.k_t), 1e-12);
}

TEST(RockBondLaw, StoredOverlapDoesNotPushAfterFailure)
{
  EXPECT_EQ(law::contact_length(1., 0.9), 0.9); // overlap as stored
  EXPECT_EQ(law::contact_length(1., 1.1), 1.);  // gap as stored: touches with the surfaces
  EXPECT_EQ(law::contact_length(1., 0.), 1.);   // never bonded
}

TEST(RockBondLaw, CoulombTrialAndReturn)
{
  const Eigen::Vector2d none = Eigen::Vector2d::Zero();
  const double k = 100., push = 5., mu = 0.4; // limit 2
  const auto stick = law::coulomb<2>(Eigen::Vector2d(0.019, 0.), k, push, mu, none);
  EXPECT_FALSE(stick.sliding);
  EXPECT_DOUBLE_EQ(stick.force.x(), 1.9);
  const auto slide = law::coulomb<2>(Eigen::Vector2d(0.03, -0.04), k, push, mu, none);
  EXPECT_TRUE(slide.sliding);
  EXPECT_NEAR(slide.force.norm(), 2., 1e-15);
  EXPECT_NEAR(slide.force.x() / slide.force.y(), -0.75, 1e-15);
  EXPECT_NEAR((k * slide.spring - slide.force).norm(), 0., 1e-15);
  // Damping must not carry the force over the bound either.
  const auto damped = law::coulomb<2>(Eigen::Vector2d(0.019, 0.), k, push, mu, Eigen::Vector2d(0.5, 0.));
  EXPECT_TRUE(damped.sliding);
  EXPECT_DOUBLE_EQ(damped.force.x(), 1.9);
  EXPECT_EQ(law::coulomb<2>(Eigen::Vector2d(0.1, 0.), k, 0., mu, none).force.norm(), 0.);
}

TEST(RockBondLaw, RigidRotationHasNoContactVelocity)
{
  const Eigen::Vector3d spin(3., -1., 2.), x1(0.1, 0.2, 0.3), x2(0.5, -0.1, 0.4);
  const auto pair = law::make_pair<3>(x1, x2, r1, r2);
  const Eigen::Vector3d v = law::contact_velocity<3>(pair, spin.cross(x1), spin.cross(x2), spin, spin);
  EXPECT_LT(v.norm(), 10. * epsilon);
}

TEST(RockBondLaw, SpringTurnsWithTheContactPlane)
{
  const Eigen::Vector3d normal = Eigen::Vector3d(1., 0.1, 0.).normalized();
  const Eigen::Vector3d turned = law::in_contact_plane<3>(Eigen::Vector3d(0., 2., 1.), normal);
  EXPECT_NEAR(turned.dot(normal), 0., epsilon * 3.);
  EXPECT_NEAR(turned.norm(), std::sqrt(5.), epsilon * 5.);
}

TEST(RockBondLaw, FullDampingIsCritical)
{
  // m12 x'' + c x' + k x = 0 is critical at c = 2 sqrt(m12 k).
  EXPECT_DOUBLE_EQ(law::viscosity(1., 2., 2., 9.), 6.);
}
