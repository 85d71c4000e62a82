// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>

namespace kerf
{
/// Contact between a surface and a body that touches it, of the tool with the rock and of debris with the rock: linear spring
/// and dashpot, no tension, Coulomb friction regularised by the tangential dashpot. Theory (9.6), (9.7).
struct ContactLaw
{
  double friction = 0.; ///< Coulomb coefficient [-]

  /// Force on the touching body [N].
  /// @param gap distance from the surface, negative in contact [m]
  /// @param normal unit vector, out of the surface
  /// @param relative velocity of the body against the surface [m/s]
  /// @param stiffness [N/m]
  /// @param damping of the dashpots, normal and tangential [N s/m]
  Eigen::Vector3d force(double gap, const Eigen::Vector3d &normal, const Eigen::Vector3d &relative, double stiffness,
                        double damping) const
  {
    if (gap >= 0.)
      return Eigen::Vector3d::Zero();
    const double normal_velocity = relative.dot(normal);
    const double normal_force = std::max(0., -stiffness * gap - damping * normal_velocity);
    const Eigen::Vector3d sliding = relative - normal_velocity * normal;
    const double speed = sliding.norm();
    Eigen::Vector3d result = normal_force * normal;
    if (speed > 0.)
      result -= std::min(friction * normal_force, damping * speed) / speed * sliding;
    return result;
  }
};
} // namespace kerf
