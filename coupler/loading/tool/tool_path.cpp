// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool_path.h"

#include <algorithm>

namespace kerf
{
using Eigen::Vector3d;

ToolPath::ToolPath(const std::vector<std::pair<double, Vector3d>> &way_points, double smoothing_time)
  : points(way_points), smoothing_time(smoothing_time)
{
}

Vector3d ToolPath::polygon(double time) const
{
  if (time <= points.front().first)
    return points.front().second;
  for (std::size_t k = 1; k < points.size(); ++k)
    if (time <= points[k].first)
    {
      const double s = (time - points[k - 1].first) / (points[k].first - points[k - 1].first);
      return (1. - s) * points[k - 1].second + s * points[k].second;
    }
  return points.back().second;
}

Vector3d ToolPath::integral(double time) const
{
  Vector3d sum = Vector3d::Zero();
  double from = points.front().first;
  if (time <= from)
    return (time - from) * points.front().second;
  for (std::size_t k = 1; k < points.size() && from < time; ++k)
  {
    const double to = std::min(time, points[k].first);
    sum += 0.5 * (to - from) * (polygon(from) + polygon(to)); // exact: linear in between
    from = to;
  }
  if (time > points.back().first)
    sum += (time - points.back().first) * points.back().second;
  return sum;
}

Vector3d ToolPath::position(double time) const
{
  if (smoothing_time <= 0.)
    return polygon(time);
  return (integral(time + 0.5 * smoothing_time) - integral(time - 0.5 * smoothing_time)) / smoothing_time;
}

Vector3d ToolPath::velocity(double time) const
{
  if (smoothing_time > 0.)
    return (polygon(time + 0.5 * smoothing_time) - polygon(time - 0.5 * smoothing_time)) / smoothing_time;
  for (std::size_t k = 1; k < points.size(); ++k)
    if (time >= points[k - 1].first && time < points[k].first)
      return (points[k].second - points[k - 1].second) / (points[k].first - points[k - 1].first);
  return Vector3d::Zero();
}
} // namespace kerf
