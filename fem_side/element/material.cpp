// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/fem_side.h"

#include <cmath>

namespace kerf::fem
{
double Material::speed_p() const
{
  return std::sqrt((lame_lambda() + 2. * lame_mu()) / density);
}

double Material::speed_s() const
{
  return std::sqrt(lame_mu() / density);
}

double smooth_start(const double time, const double ramp)
{
  if (time < 0.)
    return 0.;
  return time >= ramp ? 1. : 0.5 * (1. - std::cos(M_PI * time / ramp));
}

Eigen::Vector3d BoundaryCondition::velocity_at(const double time) const
{
  if (kind != BoundaryKind::velocity)
    return Eigen::Vector3d::Zero();
  return smooth_start(time, ramp) * velocity;
}

std::string BoundaryCondition::name() const
{
  return where.empty() ? "id " + std::to_string(id) : "'" + where + "'";
}
} // namespace kerf::fem
