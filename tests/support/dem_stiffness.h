// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <Eigen/Dense>

/// The linearised bonded network as dense matrices, written apart from the program: particle by particle (displacements, then
/// rotations), small packings only.
namespace kerf::dem::test
{
struct HighestMode
{
  double value;           ///< largest eigenvalue
  Eigen::VectorXd motion; ///< its vector, largest component 1
};

struct Network
{
  int dofs; ///< of a particle: 3 in the plane, 6 in space
  Eigen::MatrixXd stiffness, damping;
  Eigen::VectorXd mass; ///< diagonal

  /// Largest eigenvalue of M^-1 K, square rooted [rad/s].
  double largest_frequency() const
  {
    const Eigen::VectorXd scale = mass.cwiseSqrt().cwiseInverse();
    return std::sqrt(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scale.asDiagonal() * stiffness * scale.asDiagonal(),
                                                                    Eigen::EigenvaluesOnly)
                       .eigenvalues()
                       .maxCoeff());
  }

  /// Of M^-1 (dt^2 K + 2 dt C).
  HighestMode highest_mode(double dt) const
  {
    const Eigen::VectorXd scale = mass.cwiseSqrt().cwiseInverse();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(scale.asDiagonal() * (dt * dt * stiffness + 2. * dt * damping) *
                                                                scale.asDiagonal());
    const Eigen::VectorXd motion = scale.asDiagonal() * solver.eigenvectors().rightCols<1>();
    return {solver.eigenvalues().maxCoeff(), motion / motion.cwiseAbs().maxCoeff()};
  }
};

inline Network linear_network(const Packing &packing, const BondParameters &bond, double density)
{
  const int dim = packing.dim, dofs = dim == 2 ? 3 : 6;
  const int n = dofs * packing.size();
  Network network{dofs, Eigen::MatrixXd::Zero(n, n), Eigen::MatrixXd::Zero(n, n), Eigen::VectorXd(n)};
  for (int i = 0; i < packing.size(); ++i)
  {
    const double m = density * packing.volume(i);
    network.mass.segment(dofs * i, dim).setConstant(m);
    network.mass.segment(dofs * i + dim, dofs - dim)
      .setConstant((dim == 2 ? 0.5 : 0.4) * m * packing.radii[i] * packing.radii[i]);
  }
  for (const auto &ends : packing.bonds)
  {
    const Eigen::Vector3d between = packing.positions.col(ends[1]) - packing.positions.col(ends[0]);
    const Eigen::Vector3d n_12 = between.normalized();
    const double radii = packing.radii[ends[0]] + packing.radii[ends[1]];
    // Motion of the contact point with each particle, all six degrees of freedom of space.
    Eigen::Matrix<double, 3, 12> gap;
    for (int end = 0; end < 2; ++end)
    {
      const Eigen::Vector3d arm = (end == 0 ? 1. : -1.) * packing.radii[ends[end]] / radii * between;
      const double sign = end == 0 ? -1. : 1.;
      for (int axis = 0; axis < 3; ++axis)
      {
        gap.col(6 * end + axis) = sign * Eigen::Vector3d::Unit(axis);
        gap.col(6 * end + 3 + axis) = sign * Eigen::Vector3d::Unit(axis).cross(arm);
      }
    }
    const Eigen::Matrix3d springs = bond.k_t * Eigen::Matrix3d::Identity() + (bond.k_n - bond.k_t) * n_12 * n_12.transpose();
    const Eigen::Matrix<double, 12, 12> block = gap.transpose() * springs * gap;
    // Dashpots with the same fraction of critical damping of the pair along both springs, as in Onate & Rojek 2004.
    const double m_1 = density * packing.volume(ends[0]), m_2 = density * packing.volume(ends[1]);
    const double c = 2. * bond.damping * std::sqrt(m_1 * m_2 / (m_1 + m_2) * bond.k_n),
                 c_t = c * std::sqrt(bond.k_t / bond.k_n);
    const Eigen::Matrix3d dashpots = c_t * Eigen::Matrix3d::Identity() + (c - c_t) * n_12 * n_12.transpose();
    const Eigen::Matrix<double, 12, 12> viscous = gap.transpose() * dashpots * gap;
    const auto kept = [dim](int d) { return dim == 3 || d % 6 < 2 || d % 6 == 5; };
    const auto place = [&](int d) { return dofs * ends[d / 6] + (dim == 3 ? d % 6 : (d % 6 == 5 ? 2 : d % 6)); };
    for (int a = 0; a < 12; ++a)
      for (int b = 0; b < 12; ++b)
        if (kept(a) && kept(b))
        {
          network.stiffness(place(a), place(b)) += block(a, b);
          network.damping(place(a), place(b)) += viscous(a, b);
        }
  }
  return network;
}
} // namespace kerf::dem::test
