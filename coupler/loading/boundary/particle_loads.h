// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include "coupler/energy/particle_work.h"

namespace kerf
{
/// Given forces on the particles, as the finite elements feel them: tractions of the boundary, among them those that hold the
/// initial stress, and weight. Tractions act on particles next to the face, by their share of its area.
class ParticleLoads
{
public:
  ParticleLoads(const fem::Settings &body, const fem::Mesh &mesh, const dem::Packing &packing);

  /// Adds the forces at @p time [s] to the particles of this rank, weighted as they are. Their work goes to @p work; call its
  /// begin() before.
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
