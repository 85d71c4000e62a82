// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// The boundary conditions of the rock, for the particles next to its boundary: a particle whose surface is closer than half
/// a mean radius to a face obeys the condition of that face, as a node on the face does.
class ParticleBoundary
{
public:
  ParticleBoundary(const fem::Mesh &mesh, const fem::Material &rock, const std::vector<fem::BoundaryCondition> &conditions,
                   const dem::Packing &packing);

  /// Holds, drives or damps the particles of this rank; @p time is that of their positions [s], @p dt the step [s].
  void apply(dem::Particles &particles, double time, double dt);

  int n_particles() const { return n_on_boundary; }

private:
  struct Touch
  {
    int condition;          // in conditions
    Eigen::Vector3d normal; // of the face
    double area;            // share of the face that an absorbing particle stands for [m^2], 2D [m]
  };
  std::vector<fem::BoundaryCondition> conditions;
  double impedance_p, impedance_s; // rho c [Pa s/m]
  int n_on_boundary = 0;
  std::vector<std::vector<Touch>> touches; // by packing index, mostly empty

  std::uint64_t planned_order = ~0ull;
  std::vector<int> local; // particles of this rank with a touch
};
} // namespace kerf
