// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/rigid_bodies.h"

#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;
namespace
{
constexpr double huge = 1e300; // no bound
}

Disc::Disc(const ToolSettings &settings)
  : radius(settings.radius), width(settings.width), path(settings.path, settings.smoothing_time), rolling(settings.rolling)
{
}

void Disc::move_to(double time)
{
  centre = path.position(time);
  velocity = path.velocity(time);
  // Rolling without slip along the lowest point: v_x + spin R = 0.
  spin = rolling ? -velocity[0] / radius : 0.;
  angle += spin * (time - time_of_angle);
  time_of_angle = time;
}

NearestSurface Disc::nearest(const Vector3d &point) const
{
  const Vector3d arm(point[0] - centre[0], point[1] - centre[1], 0.);
  const double distance = arm.norm();
  const Vector3d radial = distance > 0. ? Vector3d(arm / distance) : Vector3d::UnitY();
  if (width == 0.)
    return {distance - radius, radial, velocity + spin * radius * Vector3d(-radial[1], radial[0], 0.)};
  const Vector3d core = std::min(distance, radius - 0.5 * width) * radial; // nearest place of the flat disc inside
  const Vector3d away = point - centre - core;
  const double length = away.norm();
  const Vector3d normal = length > 0. ? Vector3d(away / length) : Vector3d::UnitZ();
  const Vector3d place = core + 0.5 * width * normal;
  return {length - 0.5 * width, normal, velocity + spin * Vector3d(-place[1], place[0], 0.)};
}

Box Disc::bounds(double reach) const
{
  const Vector3d half(radius + reach, radius + reach, width > 0. ? 0.5 * width + reach : huge);
  return {centre - half, centre + half};
}

Platen::Platen(double y, double side, double speed, double ramp) : start(y), side(side), full_speed(speed), ramp(ramp), y(y) {}

void Platen::move_to(double time)
{
  // Half a cosine wave: s(t) = v (t - sin(pi t/T) T/pi)/2 while it lasts.
  if (time <= 0.)
    y = start, velocity = 0.;
  else if (time < ramp)
  {
    const double phase = M_PI * time / ramp;
    velocity = 0.5 * full_speed * (1. - std::cos(phase));
    y = start + 0.5 * full_speed * (time - std::sin(phase) * ramp / M_PI);
  }
  else
  {
    velocity = full_speed;
    y = start + full_speed * (time - 0.5 * ramp);
  }
}

NearestSurface Platen::nearest(const Vector3d &point) const
{
  return {side * (point[1] - y), side * Vector3d::UnitY(), velocity * Vector3d::UnitY()};
}

Box Platen::bounds(double reach) const
{
  Box box{Vector3d::Constant(-huge), Vector3d::Constant(huge)};
  if (side > 0.)
    box.upper[1] = y + reach;
  else
    box.lower[1] = y - reach;
  return box;
}
} // namespace kerf
