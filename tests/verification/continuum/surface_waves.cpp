// SPDX-License-Identifier: GPL-2.0-or-later
// Waves along the free surface of a half-space.
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// c_R/c_s: root of (2 - x)^2 = 4 sqrt(1 - x) sqrt(1 - a x), x = (c_R/c_s)^2, a = (c_s/c_p)^2 (Rayleigh 1885), by bisection.
double rayleigh_speed(const Material &material)
{
  const double a = std::pow(material.speed_s() / material.speed_p(), 2);
  const auto left = [a](const double x) { return std::pow(2. - x, 2) - 4. * std::sqrt(1. - x) * std::sqrt(1. - a * x); };
  double lower = 0.5, upper = 0.999; // left < 0 below the root, > 0 above
  for (int i = 0; i < 60; ++i)
    (left(0.5 * (lower + upper)) < 0. ? lower : upper) = 0.5 * (lower + upper);
  return std::sqrt(lower) * material.speed_s();
}

/// Angular frequency of a standing Rayleigh wave of a given length on a mesh of cells of size h: half a wavelength between
/// rollers, which its symmetry allows, from the zeros of the surface's motion over ten periods.
double standing_wave_frequency(const double wavelength, const double h)
{
  const double height = 2. * wavelength;
  Settings settings = box({0.5 * wavelength, height, 0.}, h);
  settings.boundary_conditions = {condition(0, BoundaryKind::roller), condition(1, BoundaryKind::roller),
                                  condition(2, BoundaryKind::fixed)};
  const auto side = make_fem_side(settings);
  const Material &rock = settings.material;
  const double k = 2. * M_PI / wavelength, c = rayleigh_speed(rock);
  const double q = std::sqrt(1. - std::pow(c / rock.speed_p(), 2)), s = std::sqrt(1. - std::pow(c / rock.speed_s(), 2));
  const Eigen::Matrix3Xd &X = side->mesh().nodes;
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, X.cols());
  int corner = 0;
  for (int i = 0; i < X.cols(); ++i)
  {
    const double depth = height - X(1, i), P = std::exp(-q * k * depth), S = std::exp(-s * k * depth);
    u(0, i) = 1e-7 * (P - 2. * q * s / (1. + s * s) * S) * std::sin(k * X(0, i));
    u(1, i) = -1e-7 * (q * P - 2. * q / (1. + s * s) * S) * std::cos(k * X(0, i));
    if (X(0, i) == 0. && X(1, i) == height)
      corner = i;
  }
  side->set_state(u, Eigen::Matrix3Xd::Zero(3, X.cols()));
  const double dt = 0.5 * side->stable_step();
  double previous = u(1, corner), first = 0., last = 0.;
  int zeros = 0;
  side->set_window({corner});
  Eigen::Matrix3Xd value;
  for (int n = 1; zeros < 20; ++n)
  {
    step(*side, dt, n * dt);
    side->read_window(NodalField::displacement, value);
    if (value(1, 0) * previous < 0.)
    {
      last = (n - value(1, 0) / (value(1, 0) - previous)) * dt;
      first = zeros++ == 0 ? last : first;
    }
    previous = value(1, 0);
  }
  return M_PI * (zeros - 1) / (last - first);
}
} // namespace

// Bilinear cells with lumped mass slow a wave of wavelength n h by about (pi/n)^2/6 (0.4 % at 20, 0.1 % at 40), so the finer
// mesh has a quarter of the coarser one's error.
TEST(FemSurfaceWaves, RayleighSpeed)
{
  const double wavelength = 0.2, exact = 2. * M_PI / wavelength * rayleigh_speed(rock());
  EXPECT_NEAR(rayleigh_speed(rock()) / rock().speed_s(), 0.9110, 5e-5); // nu = 0.2
  const double coarse = standing_wave_frequency(wavelength, wavelength / 20.) / exact - 1.;
  const double fine = standing_wave_frequency(wavelength, wavelength / 40.) / exact - 1.;
  RecordProperty("error_at_40_cells_percent", std::to_string(100. * fine));
  EXPECT_LT(std::abs(fine), 2e-3);
  EXPECT_NEAR(coarse / fine, 4., 1.);
}

namespace
{
/// Lamb's problem on the surface: vertical displacement at distance r in the direction of a vertical step force Z, nu = 1/4
/// (Pekeris 1955), times 16 pi mu r/Z and integrated over tau = c_s t/r from 0.
double pekeris_integral(const double tau)
{
  const double g = 0.5 * std::sqrt(3. + std::sqrt(3.)), b = 0.5 * std::sqrt(3. - std::sqrt(3.)), p_arrival = 1. / std::sqrt(3.);
  const double strong = std::sqrt(3. * std::sqrt(3.) + 5.), weak = std::sqrt(3. * std::sqrt(3.) - 5.);
  const auto before_s = [&](const double t)
  { return 0.5 * (6. * t - std::sqrt(3.) * std::acosh(2. * t) - strong * std::asin(t / g) + weak * std::acosh(t / b)); };
  const auto before_rayleigh = [&](const double t) { return 6. * t - strong * std::asin(t / g); };
  if (tau <= p_arrival)
    return 0.;
  double sum = before_s(std::min(tau, 1.)) - before_s(p_arrival);
  if (tau > 1.)
    sum += before_rayleigh(std::min(tau, g)) - before_rayleigh(1.);
  if (tau > g)
    sum += 6. * (tau - g);
  return sum;
}

/// The same for a force that grows to Z over a half cosine of length @p ramp (in tau): twice integrated by parts, because the
/// step response is singular when the Rayleigh wave arrives.
double smooth_response(const double tau, const double ramp)
{
  constexpr int n = 2000;
  double sum = 0.;
  for (int i = 0; i < n; ++i)
  {
    const double s = (i + 0.5) * ramp / n;
    sum += pekeris_integral(tau - s) * 0.5 * std::pow(M_PI / ramp, 2) * std::cos(M_PI * s / ramp) * ramp / n;
  }
  return sum;
}
} // namespace

// A quarter of the half-space between rollers, force on the corner node, receiver 20 cells away on the surface, force reached
// within 0.7 r/c_s = 14 cells of S wave. P waves from the far sides could arrive at the end only, and are absorbed. Within 5 %
// of the static displacement at all times: the mesh's dispersion at 10 to 20 cells a wavelength and the width of the nodal
// force.
TEST(FemSurfaceWaves, PekerisDisplacementInThreeDimensions)
{
  const double h = 0.01, r = 20. * h, size = 38. * h, ramp = 0.7, Z = 1e3;
  Settings settings = box({size, size, size}, h);
  settings.material.poisson = 0.25;
  settings.boundary_conditions = {condition(0, BoundaryKind::roller), condition(4, BoundaryKind::roller)};
  for (const int id : {1, 2, 5})
    settings.boundary_conditions.push_back(condition(id, BoundaryKind::absorbing));
  const auto side = make_fem_side(settings);
  const Eigen::Matrix3Xd &X = side->mesh().nodes;
  std::vector<int> nodes(2, -1); // source, receiver
  for (int i = 0; i < X.cols(); ++i)
    for (int k = 0; k < 2; ++k)
      if ((X.col(i) - Eigen::Vector3d(k * r, size, 0.)).norm() < 1e-9)
        nodes[k] = i;
  side->set_window(this_rank() == 0 ? nodes : std::vector<int>{});

  const double c_s = settings.material.speed_s(), dt = 0.8 * side->stable_step();
  const double unit = Z / (16. * M_PI * settings.material.lame_mu() * r), static_displacement = 6. * unit;
  double largest = 0., lowest = 0.;
  for (int n = 1; n * dt * c_s / r < 1.95; ++n)
  {
    side->begin_step(dt, n * dt);
    side->compute_forces();
    Eigen::Matrix3Xd push = Eigen::Matrix3Xd::Zero(3, this_rank() == 0 ? 2 : 0), u;
    if (this_rank() == 0)
      push(1, 0) = -0.25 * Z * smooth_start(n * dt, ramp * r / c_s);
    side->add_window_forces(push);
    side->end_step(dt, n * dt);
    side->read_window(NodalField::displacement, u);
    if (this_rank() != 0)
      continue;
    const double exact = unit * smooth_response(n * dt * c_s / r, ramp);
    largest = std::max(largest, std::abs(-u(1, 1) - exact));
    lowest = std::min(lowest, exact);
  }
  EXPECT_LT(largest, 0.05 * static_displacement);
  RecordProperty("largest_error_percent", std::to_string(100. * largest / static_displacement));
  if (this_rank() == 0)
  {
    EXPECT_LT(lowest, -0.1 * static_displacement) << "the surface moves up before the Rayleigh wave has passed";
  }
}
