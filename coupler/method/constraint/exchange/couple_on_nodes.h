// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf
{
/// Balances the couples of the constraint forces. The force on a particle and its reaction on the finite elements act at points
/// that differ by chi. If the force is not parallel to chi, the pair exerts a couple on the body. The gaps are small, and so
/// are the couples. Their sum is compensated by nodal forces that accelerate the nodes like a rigid body in rotation. Theory
/// (5.21), (5.22).
class CoupleOnNodes
{
public:
  /// To be called for a new nodal window. @param nodes mesh nodes. @param inverse_mass 3 x n [1/kg], 0 where the motion is
  /// prescribed
  void renew(const fem::Mesh &mesh, const std::vector<int> &nodes, const Eigen::Matrix3Xd &inverse_mass);

  /// Adds m_a theta x (x_a - centre) to @p force [N]. These forces have no resultant. Their moment is @p couple [N m] about any
  /// point. @param displacement of the nodes [m]
  void add(const Eigen::Vector3d &couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const;

private:
  void add_in_plane(double couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const;

  bool flat = false;
  Eigen::Matrix3Xd places; // reference positions of the nodes relative to their centre of mass [m]
  Eigen::VectorXd mass;    // 0 for nodes with prescribed motion, which take no part [kg]
  double total_mass = 0.;
};
} // namespace kerf
