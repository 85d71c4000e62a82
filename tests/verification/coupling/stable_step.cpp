// SPDX-License-Identifier: GPL-2.0-or-later
// The stable step that the coupled operator predicts, against runs on both sides of it.
#include "tests/support/coupled_strip.h"
#include "tests/support/stable_steps_of.h"

#include <gtest/gtest.h>

#include <random>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Strip;
using test::StripCase;

namespace
{
/// Whether noise on both sides stays what it is.
bool is_stable(const StripCase &strip, double dt, int steps)
{
  Body body(strip.settings, strip.packing, dt);
  unsigned state = 1;
  const auto noise = [&state]
  {
    state = 1664525u * state + 1013904223u;
    return 1e-9 * (static_cast<double>(state >> 8) / (1 << 23) - 1.);
  };
  body.set_state([](const Vector3d &) { return Vector3d(Vector3d::Zero()); },
                 [&](const Vector3d &) { return Vector3d(noise(), noise(), 0.); });
  body.model.start();
  dem::Particles particles = body.model.dem().particles();
  for (int i = 0; i < particles.n; ++i)
  {
    particles.velocity.col(i) += Vector3d(noise(), noise(), 0.);
    particles.angular_velocity(2, i) += 1e3 * noise();
  }
  const double before = body.model.energies().held();
  try
  {
    body.model.advance(steps);
  }
  catch (const std::exception &)
  {
    return false; // bonds ran away
  }
  const double after = body.model.energies().kinetic;
  return std::isfinite(after) && after < 100. * before;
}
} // namespace

// Forty steps at 1.02 of the limit multiply the highest mode by more than e^(2 x 0.2 x 40) if all of its frequency grows with
// the step, so a thousand steps tell; a stable run keeps its energy up to the finite step's share, bounded by 1/(1 - 0.98^2).
TEST(CoupledLimit, IsThatOfRuns)
{
  std::mt19937 random(5);
  const auto uniform = [&](double from, double to) { return std::uniform_real_distribution<double>(from, to)(random); };
  const std::string methods[] = {"penalty", "penalty_mass_scaled", "weak_multipliers"};
  for (int combination = 0; combination < 36; ++combination)
  {
    Strip shape;
    shape.random = combination % 2;
    shape.seed = 1 + combination;
    shape.region = 3;
    shape.fem = 3;
    shape.high = 3;
    shape.overlap = std::uniform_int_distribution<int>(2, 5)(random);
    shape.cell = std::uniform_int_distribution<int>(3, 6)(random);
    StripCase strip(shape);
    strip.settings.bond.damping = combination < 24 ? 0. : uniform(0.05, 0.6);
    strip.settings.constraint.method = methods[(combination / 2) % 3];
    const bool scaled = strip.settings.constraint.method == "penalty_mass_scaled";
    strip.settings.constraint.penalty_ratio = scaled ? uniform(0.1, 1.2) : std::exp(uniform(std::log(0.05), std::log(5.)));
    strip.settings.constraint.fluctuation_relaxation = uniform(0., 0.1);
    strip.settings.constraint.corrector =
      shape.random && strip.settings.constraint.method != "weak_multipliers" && combination > 12;
    const auto fem = Body::make_fem(strip.settings);
    const double limit = test::stable_steps_of(strip.settings, Mode::fixed, *fem, strip.packing).overlap;
    SCOPED_TRACE(testing::Message() << (shape.random ? "random " : "lattice ")
                                    << (strip.settings.constraint.corrector ? "corrected " : "") << "damping ratio "
                                    << strip.settings.bond.damping << " " << strip.settings.constraint.method << ", ratio "
                                    << strip.settings.constraint.penalty_ratio << ", overlap of " << shape.overlap
                                    << " cells of " << shape.cell << ", limit " << limit);
    ASSERT_GT(limit, 0.);
    EXPECT_TRUE(is_stable(strip, 0.98 * limit, 1500));
    EXPECT_FALSE(is_stable(strip, 1.02 * limit, 1500));
    if (combination < 24)
      continue;
    strip.settings.local_damping = uniform(0.1, 0.9);
    const double damped = test::stable_steps_of(strip.settings, Mode::fixed, *fem, strip.packing).overlap;
    EXPECT_LT(damped, limit);
    EXPECT_TRUE(is_stable(strip, 0.98 * damped, 1500)) << "local damping " << strip.settings.local_damping;
  }
}
