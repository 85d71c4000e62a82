// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <Eigen/Dense>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
constexpr double h = 0.05;

/// Distorted quadrilaterals in the plane, distorted hexahedra in space; any integration.
class FemForces : public ::testing::TestWithParam<std::tuple<int, Integration>>
{
protected:
  FemForces() : file("forces")
  {
    Settings settings = box({4 * h, 3 * h, dim() == 3 ? 3 * h : 0.}, h);
    settings.integration = std::get<1>(GetParam());
    settings.mesh.gmsh_file = file.path;
    if (dim() == 2)
      write_distorted_msh(file.path, 8, 6, h);
    else
      write_distorted_hex_msh(file.path, 4, 3, 3, h);
    side = make_fem_side(settings);
  }

  static int dim() { return std::get<0>(GetParam()); }
  const Eigen::Matrix3Xd &X() const { return side->mesh().nodes; }
  int n_nodes() const { return side->mesh().n_nodes(); }
  Eigen::Matrix3Xd zero() const { return Eigen::Matrix3Xd::Zero(3, n_nodes()); }
  Eigen::Matrix3Xd forces_of(const Eigen::Matrix3Xd &u)
  {
    side->set_state(u, zero());
    side->compute_forces();
    return side->gather(NodalField::force);
  }
  Eigen::Matrix3d gradient(const double size) const
  {
    Eigen::Matrix3d H;
    H << 0.9, -0.6, 0.2, 0.4, -0.7, -0.3, 0.1, 0.5, 0.8;
    if (dim() == 2)
    {
      H.row(2).setZero();
      H.col(2).setZero();
    }
    return size * H;
  }
  /// Weights that differ from point to point, the same on any number of ranks.
  static double uneven_weight(const Eigen::Vector3d &x)
  {
    return 0.5 + 0.45 * std::sin(40. * x[0]) * std::cos(55. * x[1] + 20. * x[2]);
  }
  static double force_scale() { return rock().young * h; }

  MshFile file;
  std::unique_ptr<FemSide> side;
};

/// Cauchy stress of a St. Venant-Kirchhoff solid from the textbook formulas in full tensors.
Eigen::Matrix3d cauchy(const Eigen::Matrix3d &H)
{
  const Material material = rock();
  const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + H;
  const Eigen::Matrix3d E = 0.5 * (F.transpose() * F - Eigen::Matrix3d::Identity());
  const Eigen::Matrix3d S = material.lame_lambda() * E.trace() * Eigen::Matrix3d::Identity() + 2. * material.lame_mu() * E;
  return F * S * F.transpose() / F.determinant();
}
} // namespace

INSTANTIATE_TEST_SUITE_P(Dimensions, FemForces,
                         ::testing::Combine(::testing::Values(2, 3),
                                            ::testing::Values(Integration::full, Integration::selective,
                                                              Integration::one_point)));

// Linear fields are in the space of the element, so only round-off is left.
TEST_P(FemForces, UniformStrainGivesUniformStressAndNoInnerForce)
{
  for (const double size : {1e-3, 0.2})
  {
    const Eigen::Matrix3d H = gradient(size);
    const Eigen::Matrix3Xd f = forces_of(H * X());
    const Eigen::Matrix3d exact = cauchy(H);
    const CellStress stress = side->cell_stress();
    ASSERT_EQ(stress.cell, side->owned_cells());
    Eigen::Matrix<double, 6, 1> voigt;
    voigt << exact(0, 0), exact(1, 1), exact(2, 2), exact(1, 2), exact(0, 2), exact(0, 1);
    // 1e-12 of the modulus at strain 1e-3 is about 1e-9 of the stress: cancellation in u = H X.
    for (int i = 0; i < stress.sigma.cols(); ++i)
      EXPECT_LT((stress.sigma.col(i) - voigt).norm(), 1e-12 * rock().young);

    const std::vector<bool> outer = boundary_nodes(side->mesh());
    for (int i = 0; i < n_nodes(); ++i)
    {
      if (!outer[i])
      {
        EXPECT_LT(f.col(i).norm(), 1e-12 * force_scale()) << i;
      }
    }
    EXPECT_GT(f.norm(), 0.1 * size * force_scale());
  }
}

// The nodal forces on one side add up to the traction P n on it (Piola: P = det F sigma F^-T).
TEST_P(FemForces, BoundaryForcesAreTheTraction)
{
  const Eigen::Matrix3d H = gradient(0.1);
  const Eigen::Matrix3Xd f = forces_of(H * X());
  const Eigen::Matrix3d F = Eigen::Matrix3d::Identity() + H;
  const Eigen::Vector3d traction = F.determinant() * cauchy(H) * F.inverse().transpose() * Eigen::Vector3d::UnitX();
  // Virtual work with the field that grows linearly in x: internal forces are minus the traction times the volume.
  const double volume = side->gather(NodalField::mass).row(0).sum() / rock().density;
  const Eigen::Vector3d moment = f * X().row(0).transpose();
  EXPECT_LT((moment + traction * volume).norm(), 1e-11 * traction.norm() * volume);
}

TEST_P(FemForces, RigidMotionGivesNoForce)
{
  Eigen::Matrix3Xd translation = zero();
  translation.row(0).setConstant(0.3);
  translation.row(1).setConstant(-1.7);
  EXPECT_LT(forces_of(translation).cwiseAbs().maxCoeff(), 1e-12 * force_scale());

  const Eigen::Matrix3d quarter_turn = Eigen::AngleAxisd(0.5 * M_PI, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3Xd rotation = quarter_turn * X() - X();
  EXPECT_LT(forces_of(rotation).cwiseAbs().maxCoeff(), 1e-12 * force_scale());
  EXPECT_LT(side->cell_stress().sigma.cwiseAbs().maxCoeff(), 1e-12 * rock().young);
}

// Stress turns with the body: forces of a strained and turned body are the turned forces.
TEST_P(FemForces, ForcesAreObjective)
{
  const Eigen::Matrix3Xd u = noise_field(n_nodes(), 0.02 * h, 5, dim());
  const Eigen::Matrix3Xd f = forces_of(u);
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Matrix3Xd turned = forces_of(turn * (X() + u) - X());
  EXPECT_LT((turned - turn * f).cwiseAbs().maxCoeff(), 1e-12 * force_scale());
}

// f = -dW/du along any direction, with uneven weights; central differences of a quartic energy are good to 1e-7 here.
TEST_P(FemForces, ForceIsMinusDerivativeOfEnergy)
{
  set_weights(*side, uneven_weight);
  const Eigen::Matrix3Xd u = noise_field(n_nodes(), 0.05 * h, 1, dim());
  const Eigen::Matrix3Xd direction = noise_field(n_nodes(), h, 2, dim());
  const Eigen::Matrix3Xd f = forces_of(u);
  const double step = 1e-5;
  side->set_state(u + step * direction, zero());
  const double above = side->energies().elastic;
  side->set_state(u - step * direction, zero());
  const double below = side->energies().elastic;
  const double expected = -(above - below) / (2. * step);
  EXPECT_NEAR(f.cwiseProduct(direction).sum(), expected, 1e-6 * f.norm() * direction.norm());
}

TEST_P(FemForces, IsolatedBodyHasNoTotalForceOrMoment)
{
  set_weights(*side, uneven_weight);
  const Eigen::Matrix3Xd u = noise_field(n_nodes(), 0.05 * h, 4, dim());
  const Eigen::Matrix3Xd f = forces_of(u);
  EXPECT_LT(f.rowwise().sum().norm(), 1e-12 * f.norm());
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int i = 0; i < n_nodes(); ++i)
    moment += Eigen::Vector3d(X().col(i) + u.col(i)).cross(Eigen::Vector3d(f.col(i)));
  EXPECT_LT(moment.norm(), 1e-12 * f.norm());
}

// Multiplication by 1/2 is exact in binary; only sums over ranks may be ordered differently.
TEST_P(FemForces, HalfWeightHalvesForcesMassAndEnergy)
{
  const Eigen::Matrix3Xd u = noise_field(n_nodes(), 0.02 * h, 6, dim());
  const Eigen::Matrix3Xd f = forces_of(u);
  const Eigen::Matrix3Xd mass = side->gather(NodalField::mass);
  const double energy = side->energies().elastic;
  const Eigen::Matrix<double, 6, Eigen::Dynamic> sigma = side->cell_stress().sigma;
  set_weights(*side, [](const Eigen::Vector3d &) { return 0.5; });
  EXPECT_LT((forces_of(u) - 0.5 * f).cwiseAbs().maxCoeff(), 1e-15 * force_scale());
  EXPECT_LT((side->gather(NodalField::mass) - 0.5 * mass).norm(), 1e-15 * mass.norm());
  EXPECT_NEAR(side->energies().elastic, 0.5 * energy, 1e-14 * energy);
  EXPECT_LT((side->cell_stress().sigma - sigma).norm(), 1e-15 * rock().young) << "stress is not weighted";
}

// Hooke's law of the small strain: sigma = lambda tr(H) 1 + mu (H + H^T) whatever the size, and no stress by a spin.
TEST_P(FemForces, SmallStrainIsLinear)
{
  Settings settings = box({4 * h, 3 * h, dim() == 3 ? 3 * h : 0.}, h);
  settings.strain = Strain::small;
  settings.integration = std::get<1>(GetParam());
  side = make_fem_side(settings);
  const Material material = rock();
  const Eigen::Matrix3d H = gradient(0.2), spin = H - H.transpose();
  const Eigen::Matrix3d exact =
    material.lame_lambda() * H.trace() * Eigen::Matrix3d::Identity() + material.lame_mu() * (H + H.transpose());
  Eigen::Matrix<double, 6, 1> voigt;
  voigt << exact(0, 0), exact(1, 1), exact(2, 2), exact(1, 2), exact(0, 2), exact(0, 1);
  const Eigen::Matrix3Xd f = forces_of(H * X());
  CellStress stress = side->cell_stress();
  for (int i = 0; i < stress.sigma.cols(); ++i)
    EXPECT_LT((stress.sigma.col(i) - voigt).norm(), 1e-13 * rock().young);
  const double volume = side->gather(NodalField::mass).row(0).sum() / material.density;
  EXPECT_NEAR(side->energies().elastic, 0.5 * exact.cwiseProduct(H).sum() * volume, 1e-12 * rock().young * volume);
  EXPECT_LT((forces_of(3. * H * X()) - 3. * f).norm(), 1e-12 * f.norm());
  EXPECT_LT(forces_of(spin * X()).cwiseAbs().maxCoeff(), 1e-12 * force_scale());
  EXPECT_LT(side->cell_stress().sigma.cwiseAbs().maxCoeff(), 1e-13 * rock().young);
}

TEST_P(FemForces, WeightsOutOfRangeAreRefused)
{
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(side->quadrature_points().cols()),
                        on_surface = Eigen::VectorXd::Ones(side->surface_positions().cols());
  Eigen::VectorXd alpha = ones;
  alpha[0] = -0.1;
  EXPECT_THROW(side->set_weights(alpha, on_surface), std::logic_error);
  EXPECT_THROW(side->set_weights(Eigen::VectorXd::Ones(alpha.size() + 1), on_surface), std::logic_error);
  alpha = on_surface;
  alpha[0] = 1.1;
  EXPECT_THROW(side->set_weights(ones, alpha), std::logic_error);
  EXPECT_THROW(side->set_weights(ones, Eigen::VectorXd::Ones(alpha.size() + 1)), std::logic_error);
}

// At three times the stable step the shortest wave grows by a factor of 30 in each step. Every rank gets the error.
TEST(FemSolver, RunawayIsNoticedOnEveryRank)
{
  const std::unique_ptr<FemSide> side = make_fem_side(box({0.8, 0.5, 0.}, 0.1));
  const int n = side->mesh().n_nodes();
  side->set_state(Eigen::Matrix3Xd::Zero(3, n), noise_field(n, 1e-3, 5));
  const double dt = 3. * side->stable_step();
  const auto run = [&]
  {
    for (int i = 1; i <= 2000; ++i)
      step(*side, dt, i * dt);
    side->check_motion();
  };
  EXPECT_THROW(run(), Unstable);
}
