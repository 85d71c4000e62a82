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

Eigen::Vector3d BoundaryCondition::velocity_at(const double time) const
{
  if (kind != BoundaryKind::velocity || time < 0.)
    return Eigen::Vector3d::Zero();
  if (time >= ramp)
    return velocity;
  return 0.5 * (1. - std::cos(M_PI * time / ramp)) * velocity;
}
} // namespace kerf::fem
