// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// External loads on the particles, as the finite elements feel them: tractions on the boundary, among them those that hold the
/// initial stress, and gravity. A traction acts on the particles next to the face, by their share of its area.
class ParticleLoads
{
public:
  /// @param body boundary conditions, gravity and initial stress of the rock
  ParticleLoads(const fem::Settings &body, const fem::Mesh &mesh, const dem::Packing &packing);

  /// Adds the forces at @p time [s] to the particles of this rank, times their weights. The work goes to @p work, whose begin()
  /// was called.
  void apply(dem::Particles &particles, double time, ParticleWork &work);

private:
  struct Push
  {
    int condition = 0;
    bool held_before_start = false;
    Eigen::Vector3d force; // of the unweighted particle [N]
  };

  std::vector<fem::BoundaryCondition> conditions;
  Eigen::Vector3d gravity;
  double gravity_ramp;
  std::vector<std::vector<Push>> pushes; // by index in the packing

  std::uint64_t planned_order = ~0ull;
  std::vector<int> local; // particles of this rank that are pushed
};
} // namespace kerf
