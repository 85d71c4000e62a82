// SPDX-License-Identifier: GPL-2.0-or-later
// Moduli of the same bonded packing by the static solve of its network and by moving its skin slowly in the particle engine.
#include "dem_side/bond_network/bond_network.h"
#include "dem_side/dem_side.h"
#include "dem_side/packing/laguerre.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <gtest/gtest.h>

using namespace kerf::dem;
using Eigen::Matrix3d;
using Eigen::Vector3d;

namespace
{
constexpr double d = 1e-3, k_n = 1e7, k_t = 3e6, density = 2500.;

Packing make(int dim, double side)
{
  PackingSettings settings;
  settings.dim = dim;
  settings.mean_diameter = d;
  settings.radius_spread = 0.3;
  settings.upper.setConstant(side * d);
  return generate_packing(settings);
}

double depth(const Packing &packing, const Vector3d &x)
{
  double least = 1e300;
  for (int c = 0; c < packing.dim; ++c)
    least = std::min({least, x[c] - packing.lower[c], packing.upper[c] - x[c]});
  return least;
}

/// Window over the middle, that of the static solve (or both would average other particles): its edges lie @p inset from the
/// sides and rise over @p taper [m].
struct Window
{
  const Packing &packing;
  double inset, taper;
  double operator()(const Vector3d &x) const
  {
    double value = 1.;
    for (int c = 0; c < packing.dim; ++c)
    {
      const double from_side = std::min(x[c] - packing.lower[c], packing.upper[c] - x[c]);
      const double s = std::clamp((from_side - inset) / taper, 0., 1.);
      value *= s * s * s * s * (35. - s * (84. - s * (70. - 20. * s)));
    }
    return value;
  }
  double integral() const
  {
    double product = 1.;
    for (int c = 0; c < packing.dim; ++c)
      product *= packing.upper[c] - packing.lower[c] - 2. * inset - taper;
    return product;
  }
};

struct Response
{
  Matrix3d strain = Matrix3d::Zero(), stress = Matrix3d::Zero();
};

/// Drives the skin with the uniform strain, smoothly from rest to rest, waits until the inside has settled, and measures strain
/// (least squares) and stress (bond virial of the engine's forces) in the window.
Response slow_test(const Packing &packing, const Matrix3d &strain, const Window &window, int ramp_steps, int settle_steps)
{
  Settings settings;
  settings.packing = &packing;
  settings.bond = {k_n, k_t, 1e3 * k_n, 1e3 * k_n, 0., 0.}; // no bond fails
  settings.density = density;
  settings.local_damping = 0.2;
  settings.time_step = 0.5 * 2. / largest_frequency(packing, k_n, k_t, density);
  settings.domain_lower = packing.lower.array() - d;
  settings.domain_upper = packing.upper.array() + d;
  DemSide side(settings);
  std::vector<NewParticle> all(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    all[i].index = i;
  side.insert(all);
  side.set_weights(Eigen::VectorXd::Ones(packing.size()));

  int step = 0;
  const double ramp = ramp_steps * settings.time_step;
  const auto drive = [&](Phase phase, Particles &p)
  {
    step += phase == Phase::step;
    const double s = std::min(1., double(step) / ramp_steps), rate = (1. - std::cos(2. * std::acos(-1.) * s)) / ramp;
    for (int k = 0; k < p.n; ++k)
    {
      const Vector3d x = packing.positions.col(p.index[k]);
      if (depth(packing, x) >= 1.5 * d)
        continue;
      p.velocity.col(k) = rate * strain * x;
      p.angular_velocity.col(k).setZero();
      p.force.col(k).setZero();
      p.torque.col(k).setZero();
    }
  };
  side.setup(drive);
  side.advance(ramp_steps + settle_steps, drive);

  const Particles p = side.particles();
  std::vector<Vector3d> displacement(packing.size()), rotation(packing.size());
  for (int k = 0; k < p.n; ++k)
  {
    displacement[p.index[k]] = p.position.col(k) - packing.positions.col(p.index[k]);
    rotation[p.index[k]] = 2. * Vector3d(p.rotation[4 * k + 1], p.rotation[4 * k + 2], p.rotation[4 * k + 3]);
  }
  Response result;
  double weights = 0.;
  Vector3d centre = Vector3d::Zero(), mean = Vector3d::Zero();
  for (int i = 0; i < packing.size(); ++i)
  {
    const double w = window(packing.positions.col(i));
    weights += w;
    centre += w * packing.positions.col(i);
    mean += w * displacement[i];
  }
  centre /= weights;
  mean /= weights;
  Matrix3d moment = Matrix3d::Zero(), covariance = Matrix3d::Zero();
  for (int i = 0; i < packing.size(); ++i)
  {
    const Vector3d arm = packing.positions.col(i) - centre;
    moment += window(packing.positions.col(i)) * arm * arm.transpose();
    covariance += window(packing.positions.col(i)) * (displacement[i] - mean) * arm.transpose();
  }
  if (packing.dim == 2)
    moment(2, 2) = 1.;
  const Matrix3d gradient = covariance * moment.inverse();
  result.strain = (gradient + gradient.transpose()) / 2.;

  // In 2D the stress is averaged over space, in 3D, where the window is only 8 diameters wide, over the particles' cells as in
  // the static solve: one is independent of it, the other shows the difference of the two solves alone.
  double volume = window.integral();
  if (packing.dim == 3)
  {
    const Eigen::VectorXd cells = laguerre_volumes(packing, std::vector<char>(packing.size(), 1));
    volume = 0.;
    for (int i = 0; i < packing.size(); ++i)
      volume += window(packing.positions.col(i)) * cells[i];
  }
  for (const ActiveBond &bond : side.bonds())
  {
    const int i = bond.first, j = bond.second;
    const Vector3d branch = packing.positions.col(j) - packing.positions.col(i), n = branch.normalized();
    const double lever_i = branch.norm() * packing.radii[i] / (packing.radii[i] + packing.radii[j]);
    // The engine gives the size of the shear force; it points along the tangential displacement at the contact.
    const Vector3d jump =
      displacement[j] - rotation[j].cross((branch.norm() - lever_i) * n) - displacement[i] - rotation[i].cross(lever_i * n);
    const Vector3d tangential = jump - n * n.dot(jump);
    const Vector3d force = bond.normal_force * n + bond.shear_force * tangential.normalized();
    double weight = 0.;
    if (packing.dim == 2) // mean along the branch, Simpson
      for (const double s : {0., 0.5, 1.})
        weight += (s == 0.5 ? 4. : 1.) / 6. * window(packing.positions.col(i) + s * branch);
    else
      weight = (window(packing.positions.col(i)) * lever_i + window(packing.positions.col(j)) * (branch.norm() - lever_i)) /
               branch.norm();
    result.stress += weight * force * branch.transpose();
  }
  result.stress = (result.stress + result.stress.transpose()).eval() / (2. * volume);
  return result;
}

/// Stiffness in the order of Moduli::stiffness from a test for each component of strain, symmetric part.
Eigen::MatrixXd slow_stiffness(const Packing &packing, const Window &window, int ramp_steps, int settle_steps)
{
  using Place = std::array<int, 2>;
  const std::vector<Place> flat = {{{0, 0}}, {{1, 1}}, {{0, 1}}};
  const std::vector<Place> solid = {{{0, 0}}, {{1, 1}}, {{2, 2}}, {{1, 2}}, {{0, 2}}, {{0, 1}}};
  const std::vector<Place> &places = packing.dim == 2 ? flat : solid;
  const int n = static_cast<int>(places.size());
  Eigen::MatrixXd stress(n, n), strain(n, n);
  for (int k = 0; k < n; ++k)
  {
    Matrix3d unit = Matrix3d::Zero();
    unit(places[k][0], places[k][1]) += 0.5e-5;
    unit(places[k][1], places[k][0]) += 0.5e-5;
    const Response response = slow_test(packing, unit, window, ramp_steps, settle_steps);
    for (int l = 0; l < n; ++l)
    {
      stress(l, k) = response.stress(places[l][0], places[l][1]);
      strain(l, k) = response.strain(places[l][0], places[l][1]) * (l < packing.dim ? 1. : 2.);
    }
  }
  const Eigen::MatrixXd stiffness = stress * strain.inverse();
  return (stiffness + stiffness.transpose()) / 2.;
}

/// E and nu of the isotropic tensor closest to a stiffness.
std::pair<double, double> young_and_poisson(const Eigen::MatrixXd &c, int dim)
{
  double sum = 0., diagonal = 0., shears = 0.;
  for (int i = 0; i < c.rows(); ++i)
  {
    (i < dim ? diagonal : shears) += c(i, i);
    for (int j = 0; i < dim && j < dim; ++j)
      sum += c(i, j);
  }
  const double bulk = sum / (dim * dim), off_diagonal = (sum - diagonal) / 2.;
  const double shear =
    dim == 2 ? (diagonal - 2. * off_diagonal + 4. * shears) / 8. : (diagonal - off_diagonal + 3. * shears) / 15.;
  const double lambda = bulk - 2. / dim * shear;
  return {shear * (3. * lambda + 2. * shear) / (lambda + shear), lambda / (2. * (lambda + shear))};
}

void expect_agreement(const Packing &packing, const Window &window, int ramp_steps, int settle_steps)
{
  const Moduli fixed = relaxed_moduli(packing, k_n, k_t);
  const Eigen::MatrixXd slow = slow_stiffness(packing, window, ramp_steps, settle_steps);
  const auto [young, poisson] = young_and_poisson(slow, packing.dim);
  EXPECT_NEAR(young / fixed.young, 1., 0.01);
  EXPECT_NEAR(poisson / fixed.poisson, 1., 0.01);
  // Each modulus, not only their mean.
  EXPECT_LE((slow - fixed.stiffness).cwiseAbs().maxCoeff(), 0.01 * fixed.stiffness(0, 0)) << slow << "\n\n" << fixed.stiffness;
}
} // namespace

TEST(StaticAndDynamicModuli, AgreeIn2D)
{
  const double side = 34. * d, inset = 0.1 * side;
  const Packing packing = make(2, 34.);
  expect_agreement(packing, {packing, inset, 0.27 * (side - 2. * inset)}, 4000, 2000);
}

TEST(StaticAndDynamicModuli, AgreeIn3D)
{
  const Packing packing = make(3, 14.);
  expect_agreement(packing, {packing, 3. * packing.mean_diameter, 3. * packing.mean_diameter}, 1000, 600);
}
