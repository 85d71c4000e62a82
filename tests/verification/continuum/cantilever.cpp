// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
constexpr double length = 1., depth = 0.1, load = 10.; // [m], [m], shear traction of the end [Pa]

/// A cantilever along x in plane strain, a given number of square cells over its depth, end load by traction. Statics and
/// modes come from the solver's own forces and masses, so small that the law is linear.
class Cantilever
{
public:
  explicit Cantilever(const int n_over_depth)
  {
    Settings settings = box({length, depth, 0.}, depth / n_over_depth);
    BoundaryCondition push;
    push.where = "x > 1 - 1e-6";
    push.kind = BoundaryKind::traction;
    push.traction = {0., -load, 0.};
    settings.boundary_conditions = {condition(0, BoundaryKind::fixed), push};
    loaded = make_fem_side(settings);
    settings.boundary_conditions.pop_back();
    free = make_fem_side(settings);
    const Eigen::Matrix3Xd zero = Eigen::Matrix3Xd::Zero(3, X().cols());
    movable = (X().row(0).array() > 0.).cast<double>().replicate(3, 1).matrix();
    loaded->set_state(zero, zero);
    loaded->compute_forces();
    external = loaded->gather(NodalField::force).cwiseProduct(movable);
    mass = free->gather(NodalField::mass);
  }

  const Eigen::Matrix3Xd &X() const { return free->mesh().nodes; }
  /// K u of the movable nodes.
  Eigen::Matrix3Xd stiffness_times(const Eigen::Matrix3Xd &u) const
  {
    const double size = 1e-7 * depth / std::max(u.cwiseAbs().maxCoeff(), 1e-300);
    free->set_state(size * u, Eigen::Matrix3Xd::Zero(3, u.cols()));
    free->compute_forces();
    return -free->gather(NodalField::force).cwiseProduct(movable) / size;
  }
  /// Solves K u = f by conjugate gradients from a given start.
  Eigen::Matrix3Xd solve(const Eigen::Matrix3Xd &f, Eigen::Matrix3Xd u) const
  {
    Eigen::Matrix3Xd residual = f - stiffness_times(u), direction = residual;
    double square = residual.squaredNorm();
    const double end = 1e-14 * f.squaredNorm();
    for (int i = 0; i < 5000 && square > end; ++i)
    {
      const Eigen::Matrix3Xd product = stiffness_times(direction);
      const double step = square / direction.cwiseProduct(product).sum();
      u += step * direction;
      residual -= step * product;
      const double next = residual.squaredNorm();
      direction = residual + next / square * direction;
      square = next;
    }
    return u;
  }
  Eigen::Matrix3Xd static_deflection() const { return solve(external, Eigen::Matrix3Xd::Zero(3, X().cols())); }
  /// Mean deflection of the end, from the work of the load.
  double end_deflection(const Eigen::Matrix3Xd &u) const { return external.cwiseProduct(u).sum() / (load * depth); }
  /// First mode by inverse iteration from the static deflection; returns its angular frequency.
  double first_mode(Eigen::Matrix3Xd &mode) const
  {
    double omega2 = 0.;
    for (int i = 0; i < 6; ++i)
    {
      mode /= std::sqrt(mode.cwiseProduct(mass).cwiseProduct(mode).sum());
      const Eigen::Matrix3Xd inertia = mass.cwiseProduct(mode).cwiseProduct(movable);
      omega2 = mode.cwiseProduct(stiffness_times(mode)).sum();
      mode = solve(inertia, mode / omega2);
    }
    return std::sqrt(omega2);
  }

  std::unique_ptr<FemSide> loaded, free;
  Eigen::Matrix3Xd movable, external, mass;
};

/// Order of convergence from three meshes, each with half the cell size of the one before.
double order(const std::array<double, 3> &values)
{
  return std::log2((values[1] - values[0]) / (values[2] - values[1]));
}
/// The limit, by Richardson's extrapolation for order 2.
double limit(const std::array<double, 3> &values)
{
  return values[2] + (values[2] - values[1]) / 3.;
}
} // namespace

// Plane-strain Timoshenko beam: E' = E/(1 - nu^2), deflection P L^3/(3 E' I) + P L/(kappa G A), kappa = 5/6; first frequency
// 1.8751^2 sqrt(E' I/(rho A L^4)) of a slender beam, which shear and rotary inertia lower by about 2 (D/L)^2 = 2 %. The clamped
// end of a plane body is softer than that of a beam by the warping it suppresses, half a per cent at L/D = 10.
TEST(FemCantilever, DeflectionAndFirstFrequencyConvergeWithOrderTwo)
{
  const Material material = rock();
  const double E = material.young / (1. - 0.04), I = std::pow(depth, 3) / 12., G = material.lame_mu();
  std::array<double, 3> deflection, frequency;
  for (int k = 0; k < 3; ++k)
  {
    const Cantilever beam(3 << k);
    Eigen::Matrix3Xd shape = beam.static_deflection();
    deflection[k] = beam.end_deflection(shape);
    frequency[k] = beam.first_mode(shape);
  }
  EXPECT_NEAR(order(deflection), 2., 0.15);
  EXPECT_NEAR(order(frequency), 2., 0.15);
  const double P = load * depth;
  const double exact = P * std::pow(length, 3) / (3. * E * I) + P * length / (5. / 6. * G * depth);
  EXPECT_NEAR(limit(deflection), exact, 0.01 * exact);
  const double slender = std::pow(1.8751 / length, 2) * std::sqrt(E * I / (material.density * depth));
  EXPECT_NEAR(limit(frequency), 0.985 * slender, 0.015 * slender);
}

// In time: let go from its first mode, the beam is back after a period and opposite after half of it. 1e-3: the law's
// nonlinearity at this amplitude and the step (omega dt tiny) are far below, the mode is good to 1e-4.
TEST(FemCantilever, SwingsAtItsFirstFrequency)
{
  const Cantilever beam(4);
  Eigen::Matrix3Xd mode = beam.static_deflection();
  const double omega = beam.first_mode(mode);
  mode *= 1e-5 * depth / mode.cwiseAbs().maxCoeff();
  beam.free->set_state(mode, Eigen::Matrix3Xd::Zero(3, mode.cols()));
  const int n_half = static_cast<int>(std::ceil(M_PI / omega / (0.9 * beam.free->stable_step())));
  const double dt = M_PI / omega / n_half;
  for (int n = 1; n <= 2 * n_half; ++n)
  {
    step(*beam.free, dt, n * dt);
    if (n % n_half == 0)
    {
      const Eigen::Matrix3Xd u = beam.free->gather(NodalField::displacement);
      EXPECT_LT((u - (n == n_half ? -1. : 1.) * mode).norm(), 1e-3 * mode.norm());
    }
  }
}
