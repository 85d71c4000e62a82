// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <Eigen/Dense>

/// The linearised bonded network as dense matrices, written apart from the program: particle by particle (displacements, then
/// rotations), small packings only.
namespace kerf::dem::test
{
struct Network
{
  int dofs; ///< of a particle: 3 in the plane, 6 in space
  Eigen::MatrixXd stiffness;
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
};

inline Network linear_network(const Packing &packing, const BondParameters &bond, double density)
{
  const int dim = packing.dim, dofs = dim == 2 ? 3 : 6;
  Network network{dofs, Eigen::MatrixXd::Zero(dofs * packing.size(), dofs * packing.size()),
                  Eigen::VectorXd(dofs * packing.size())};
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
    const Eigen::Vector3d n = between.normalized();
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
    const Eigen::Matrix3d springs = bond.k_t * Eigen::Matrix3d::Identity() + (bond.k_n - bond.k_t) * n * n.transpose();
    const Eigen::Matrix<double, 12, 12> block = gap.transpose() * springs * gap;
    const auto kept = [dim](int d) { return dim == 3 || d % 6 < 2 || d % 6 == 5; };
    const auto place = [&](int d) { return dofs * ends[d / 6] + (dim == 3 ? d % 6 : (d % 6 == 5 ? 2 : d % 6)); };
    for (int a = 0; a < 12; ++a)
      for (int b = 0; b < 12; ++b)
        if (kept(a) && kept(b))
          network.stiffness(place(a), place(b)) += block(a, b);
  }
  return network;
}
} // namespace kerf::dem::test
