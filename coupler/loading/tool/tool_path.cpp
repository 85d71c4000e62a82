// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool_path.h"

#include <algorithm>

namespace kerf
{
using Eigen::Vector3d;

ToolPath::ToolPath(const std::vector<std::pair<double, Vector3d>> &way_points, double smoothing_time)
  : points(way_points), smoothing_time(smoothing_time)
{
  integrals.assign(points.size(), Vector3d::Zero());
  for (std::size_t k = 1; k < points.size(); ++k) // exact: linear in between
    integrals[k] = integrals[k - 1] + 0.5 * (points[k].first - points[k - 1].first) * (points[k - 1].second + points[k].second);
}

/// The first way point after the first one that is not before @p time; their number when all are.
std::size_t ToolPath::end_of_segment(double time) const
{
  const auto before = [](const std::pair<double, Vector3d> &point, double t) { return point.first < t; };
  return std::lower_bound(points.begin() + 1, points.end(), time, before) - points.begin();
}

Vector3d ToolPath::polygon(double time) const
{
  if (time <= points.front().first)
    return points.front().second;
  const std::size_t k = end_of_segment(time);
  if (k == points.size())
    return points.back().second;
  const double s = (time - points[k - 1].first) / (points[k].first - points[k - 1].first);
  return (1. - s) * points[k - 1].second + s * points[k].second;
}

Vector3d ToolPath::integral(double time) const
{
  if (time <= points.front().first)
    return (time - points.front().first) * points.front().second;
  const std::size_t k = end_of_segment(time) - 1;
  const auto &[from, place] = points[k];
  return integrals[k] + 0.5 * (time - from) * (place + polygon(time));
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
  const auto later = [](double t, const std::pair<double, Vector3d> &point) { return t < point.first; };
  const std::size_t k = std::upper_bound(points.begin(), points.end(), time, later) - points.begin();
  if (k == 0 || k == points.size())
    return Vector3d::Zero();
  return (points[k].second - points[k - 1].second) / (points[k].first - points[k - 1].first);
}
} // namespace kerf
