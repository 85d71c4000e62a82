// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"

namespace kerf
{
/// Particles whose forces go to arrays of their own, to see what one source adds.
class ForceCatcher
{
public:
  /// The particles with zero forces; valid until the next call.
  dem::Particles &catch_forces(const dem::Particles &particles);
  /// Adds what the @p touched particles caught to @p particles and to @p work; one may be named twice.
  void release(const std::vector<int> &touched, dem::Particles &particles, ParticleWork &work);

private:
  Eigen::Matrix3Xd force, torque;
  dem::Particles caught;
};
} // namespace kerf
