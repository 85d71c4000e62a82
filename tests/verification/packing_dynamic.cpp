// SPDX-License-Identifier: GPL-2.0-or-later
// Moduli of the same bonded packing by the static solve of its network and by moving its skin slowly in the particle engine.
#include "dem_side/bond_network.h"
#include "dem_side/dem_side.h"

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
    double weight = 0.; // mean along the branch, Simpson
    for (const double s : {0., 0.5, 1.})
      weight += (s == 0.5 ? 4. : 1.) / 6. * window(packing.positions.col(i) + s * branch);
    result.stress += weight * force * branch.transpose();
  }
  result.stress = (result.stress + result.stress.transpose()).eval() / (2. * window.integral());
  return result;
}

Matrix3d unit_strain(int r, int c)
{
  Matrix3d strain = Matrix3d::Zero();
  strain(r, c) += 0.5e-5;
  strain(c, r) += 0.5e-5;
  return strain;
}
} // namespace

TEST(StaticAndDynamicModuli, AgreeIn2D)
{
  const Packing packing = make(2, 34.);
  const Moduli fixed = relaxed_moduli(packing, k_n, k_t);
  const double inset = 5. * packing.mean_diameter;
  const Window window{packing, inset, 0.45 * (34. * d - 2. * inset)};
  Eigen::Matrix3d stress, strain;
  const std::array<Matrix3d, 3> cases = {unit_strain(0, 0), unit_strain(1, 1), unit_strain(0, 1)};
  for (int k = 0; k < 3; ++k)
  {
    const Response r = slow_test(packing, cases[k], window, 4000, 2000);
    stress.col(k) << r.stress(0, 0), r.stress(1, 1), r.stress(0, 1);
    strain.col(k) << r.strain(0, 0), r.strain(1, 1), 2. * r.strain(0, 1);
  }
  const Eigen::Matrix3d c = stress * strain.inverse();
  const double bulk = (c(0, 0) + c(1, 1) + c(0, 1) + c(1, 0)) / 4.;
  const double shear = (c(0, 0) + c(1, 1) - c(0, 1) - c(1, 0) + 4. * c(2, 2)) / 8., lambda = bulk - shear;
  EXPECT_NEAR(shear * (3. * lambda + 2. * shear) / (lambda + shear) / fixed.young, 1., 0.01);
  EXPECT_NEAR(lambda / (2. * (lambda + shear)), fixed.poisson, 0.01 * fixed.poisson + 1e-3);
  // Each modulus, not only the mean: 1 % of the largest.
  EXPECT_LE((c - fixed.stiffness).cwiseAbs().maxCoeff(), 0.01 * fixed.stiffness(0, 0)) << c << "\n\n" << fixed.stiffness;
}

TEST(StaticAndDynamicModuli, AgreeIn3D)
{
  const Packing packing = make(3, 14.);
  const Moduli fixed = relaxed_moduli(packing, k_n, k_t);
  const Window window{packing, 3. * packing.mean_diameter, 3. * packing.mean_diameter};
  const Response stretch = slow_test(packing, unit_strain(0, 0), window, 1500, 1000);
  const Response shear = slow_test(packing, unit_strain(1, 2), window, 1500, 1000);
  const auto compare = [&](const Response &r, const std::vector<int> &moduli, const char *name)
  {
    Eigen::Matrix<double, 6, 1> stress, strain;
    stress << r.stress(0, 0), r.stress(1, 1), r.stress(2, 2), r.stress(1, 2), r.stress(0, 2), r.stress(0, 1);
    strain << r.strain(0, 0), r.strain(1, 1), r.strain(2, 2), 2. * r.strain(1, 2), 2. * r.strain(0, 2), 2. * r.strain(0, 1);
    const Eigen::Matrix<double, 6, 1> expected = fixed.stiffness * strain;
    for (const int k : moduli)
      EXPECT_NEAR(stress[k] / expected[k], 1., 0.01) << name << ", component " << k;
    // Couplings that an isotropic rock does not have are fluctuations; the two ways to average over a window of 8 diameters
    // see them alike to 2 % of the largest stress.
    EXPECT_LE((stress - expected).cwiseAbs().maxCoeff(), 0.02 * expected.cwiseAbs().maxCoeff())
      << name << ": " << stress.transpose() << " expected " << expected.transpose();
  };
  compare(stretch, {0, 1, 2}, "stretch along x");
  compare(shear, {3}, "shear yz");
}
