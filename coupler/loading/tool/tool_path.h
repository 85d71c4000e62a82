// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace kerf
{
/// Prescribed motion of the disc's centre: the polygon of way points, averaged over the smoothing time. The velocity is
/// continuous. On straight parts the path is exact. Theory (9.1).
class ToolPath
{
public:
  ToolPath() = default;
  /// @param way_points time [s] and place [m], by rising time
  /// @param smoothing_time [s]; 0: the polygon itself
  ToolPath(const std::vector<std::pair<double, Eigen::Vector3d>> &way_points, double smoothing_time);

  Eigen::Vector3d position(double time) const; ///< [m]
  Eigen::Vector3d velocity(double time) const; ///< [m/s]; the cost grows with the logarithm of the number of way points

private:
  std::size_t end_of_segment(double time) const;
  Eigen::Vector3d polygon(double time) const;
  /// Integral of the polygon from the time of the first way point on [m s].
  Eigen::Vector3d integral(double time) const;

  std::vector<std::pair<double, Eigen::Vector3d>> points;
  std::vector<Eigen::Vector3d> integrals; // up to each way point [m s]
  double smoothing_time = 0.;
};
} // namespace kerf
