// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"

namespace kerf
{
/// Records the forces of one source: the source acts on particles with force arrays of their own, which are then added to the
/// particles and to the work of this source.
class ForceCatcher
{
public:
  /// The particles with zero forces; valid until the next call.
  dem::Particles &catch_forces(const dem::Particles &particles);
  /// Adds the recorded forces to @p particles and to @p work and clears them.
  /// @param touched places of the particles with forces; a place may be there twice
  void release(const std::vector<int> &touched, dem::Particles &particles, ParticleWork &work);

private:
  Eigen::Matrix3Xd force, torque;
  dem::Particles caught;
};
} // namespace kerf
