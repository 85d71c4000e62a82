// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

namespace kerf
{
/// Prescribed motion of the disc centre: the polygon of way points averaged over the smoothing time, so the velocity is
/// continuous and on straight parts the path is exact.
class ToolPath
{
public:
  ToolPath() = default;
  ToolPath(const std::vector<std::pair<double, Eigen::Vector3d>> &way_points, double smoothing_time);

  Eigen::Vector3d position(double time) const; ///< [m]
  Eigen::Vector3d velocity(double time) const; ///< [m/s]

private:
  Eigen::Vector3d polygon(double time) const;
  /// Integral of the polygon from the first way point's time.
  Eigen::Vector3d integral(double time) const;

  std::vector<std::pair<double, Eigen::Vector3d>> points;
  double window = 0.;
};
} // namespace kerf
