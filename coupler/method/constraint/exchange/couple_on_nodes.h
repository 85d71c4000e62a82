// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf
{
/// Couples of ties on the nodes that carry them. A tie's force on its particle and the reaction at the point of the finite
/// elements are apart by chi: where the force is not along chi they turn the body. The gaps are small and so are the couples;
/// the nodes get them back together, as the forces that turn a rigid body with their masses. Theory (5.21), (5.22).
class CoupleOnNodes
{
public:
  /// For a new window. @param nodes of the mesh. @param inverse_mass 3 x n, 0 where the motion is prescribed [1/kg]
  void renew(const fem::Mesh &mesh, const std::vector<int> &nodes, const Eigen::Matrix3Xd &inverse_mass);

  /// @param force += m_a theta x (x_a - centre): no sum, moment @p couple [N m] about any point.
  void add(const Eigen::Vector3d &couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const;

private:
  void add_in_plane(double couple, const Eigen::Matrix3Xd &displacement, Eigen::Matrix3Xd &force) const;

  bool flat = false;
  Eigen::Matrix3Xd places; // of the nodes in the reference configuration, from their centre [m]
  Eigen::VectorXd mass;    // 0 for those that cannot carry a part [kg]
  double total_mass = 0.;
};
} // namespace kerf
