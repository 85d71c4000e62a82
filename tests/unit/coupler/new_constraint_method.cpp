// SPDX-License-Identifier: GPL-2.0-or-later
// A coupling method that kerf does not have, in one file and with one line of registration: springs between particles and their
// points, written with the slow functions of ParticleInterpolation. They are those of Coupling/Method = penalty.
#include "coupler/application/case_file/case_file.h"
#include "coupler/base/errors.h"
#include "coupler/method/constraint/exchange/particle_interpolation.h"
#include "coupler/method/constraint/make_constraint.h"
#include "tests/support/coupled_strip.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>

using namespace kerf;

namespace
{
bool fail_in_step = false;

class TestSprings : public Constraint
{
public:
  explicit TestSprings(const ConstraintModel &model)
    : stiffness(model.settings.penalty_ratio * model.k_n), interpolation(*model.packing, WindowNodes::own, model.comm)
  {
  }
  void set_time_step(double) override {}
  void set_particles(const std::vector<TiedParticle> &particles) override { interpolation.set_particles(particles); }
  void apply(dem::Phase, dem::Particles &particles, fem::FemSide &fem) override
  {
    if (fail_in_step)
      throw std::logic_error("TestSprings: misuse on purpose");
    interpolation.update(particles, fem);
    Eigen::Matrix3Xd displacement, force = Eigen::Matrix3Xd::Zero(3, interpolation.n_window());
    fem.read_window(fem::NodalField::displacement, displacement);
    stored = 0.;
    for (const InterpolatedParticle &entry : interpolation.entries())
    {
      const Eigen::Vector3d gap = interpolation.chi(entry, particles, displacement), pull = entry.share * stiffness * gap;
      particles.force.col(entry.particle) -= pull;
      ParticleInterpolation::spread(entry, pull, force);
      stored += 0.5 * pull.dot(gap);
    }
    fem.add_window_forces(force);
  }
  Tie tie() const override { return Tie::spring; }
  ConstraintEnergy energy() const override { return {stored, 0.}; }
  int n_particles() const override { return interpolation.n_particles(); }
  double bound_of_added_omega2(double dt, double lightest) const override { return dt * dt * stiffness / lightest; }
  double operator_coefficient(const OperatorTie &tie, double dt) const override { return dt * dt * tie.share * stiffness; }

private:
  double stiffness, stored = 0.;
  ParticleInterpolation interpolation;
};

const bool registered = (register_constraint_method(
                           {"test_springs", [](const ConstraintModel &model) { return std::make_unique<TestSprings>(model); }}),
                         true);

/// A strip of a lattice on both sides, with a velocity that stretches it.
std::unique_ptr<test::Body> moving_strip(const std::string &method)
{
  test::Strip strip;
  strip.region = 2;
  strip.overlap = 3;
  strip.fem = 3;
  strip.high = 2;
  test::StripCase lattice(strip);
  lattice.settings.constraint.method = method;
  lattice.settings.constraint.penalty_ratio = 0.3;
  auto body = std::make_unique<test::Body>(lattice.settings, lattice.packing, Mode::fixed);
  const double length = lattice.settings.body.mesh.upper[0];
  body->set_state([](const Eigen::Vector3d &) { return Eigen::Vector3d::Zero().eval(); },
                  [&](const Eigen::Vector3d &x) { return Eigen::Vector3d(0.1 * x[0] / length, 0., 0.); });
  body->model.start();
  return body;
}
} // namespace

// The strip moves as with the penalty, whose springs are summed in another order: round-off grows to some 1e-10 over the steps.
TEST(NewConstraintMethod, OneFileAndOneLine)
{
  ASSERT_TRUE(registered);
  const auto added = moving_strip("test_springs"), built_in = moving_strip("penalty");
  EXPECT_EQ(added->dt, built_in->dt); // the same coupled operator
  added->model.advance(200);
  built_in->model.advance(200);
  const Eigen::Matrix3Xd u = added->particle_displacements(), expected = built_in->particle_displacements();
  EXPECT_GT(expected.norm(), 0.);
  EXPECT_LT((u - expected).norm(), 1e-9 * expected.norm());
  const EnergyLedger energy = added->model.energies();
  EXPECT_GT(energy.coupling, 0.);
  EXPECT_NEAR(energy.residual(), built_in->model.energies().residual(), 1e-9 * energy.kinetic);
}

// The case file takes its name, and the reference of the parameters says so.
TEST(NewConstraintMethod, IsAValueOfCouplingMethod)
{
  std::ostringstream reference;
  write_parameter_reference(reference);
  EXPECT_NE(reference.str().find("test_springs"), std::string::npos);
}

TEST(NewConstraintMethod, NamesAreTakenOnce)
{
  EXPECT_THROW(register_constraint_method({"penalty", nullptr}), std::logic_error);
  EXPECT_THROW(constraint_method("no_such_method"), std::logic_error);
}

// A bug in a step is none of the physics.
TEST(NewConstraintMethod, MisuseInAStepIsNoUnstableRun)
{
  const auto body = moving_strip("test_springs");
  fail_in_step = true;
  try
  {
    body->model.advance(1);
    FAIL() << "no error";
  }
  catch (const UnstableRun &)
  {
    FAIL() << "taken for an unstable run";
  }
  catch (const std::logic_error &error)
  {
    EXPECT_STREQ(error.what(), "TestSprings: misuse on purpose");
  }
  fail_in_step = false;
}
