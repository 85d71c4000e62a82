// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/particle_work.h"
#include "coupler/loading/boundary/tributary_areas.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// External loads on the particles, as the finite elements feel them: tractions on the boundary, among them those that hold the
/// initial stress, and gravity. A traction acts on the particles next to the face, by their shares of its area.
class ParticleLoads
{
public:
  /// @param body boundary conditions, gravity and initial stress of the rock. @p mesh and @p packing are kept by reference
  ParticleLoads(const fem::Settings &body, const fem::Mesh &mesh, const dem::Packing &packing);

  /// Loaded faces: their owner sets the weights and calls update_forces().
  std::vector<TributaryAreas> &loaded_areas() { return sides; }
  void update_forces();

  /// Adds the forces at @p time [s] to the particles of this rank. The work goes to @p work, whose begin() was called.
  void apply(dem::Particles &particles, double time, ParticleWork &work);

private:
  struct Load
  {
    Eigen::Vector3d traction = Eigen::Vector3d::Zero(); // [Pa]
    Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();   // adds stress times outer normal [Pa]
    double ramp = 0.;                                   // [s]
    bool held_before_start = false;
  };
  struct Push
  {
    int load = 0;
    Eigen::Vector3d force; // weighted [N]
  };

  std::vector<Load> loads;
  std::vector<TributaryAreas> sides; // of each load
  Eigen::Vector3d gravity;
  double gravity_ramp;
  std::vector<std::vector<Push>> pushes; // by index in the packing

  std::uint64_t planned_order = ~0ull;
  std::vector<int> local; // particles of this rank that are pushed
};
} // namespace kerf
