// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/tied_particle.h"
#include "coupler/energy/particle_work.h"
#include "coupler/loading/boundary/tributary_areas.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <array>
#include <vector>

namespace kerf
{
/// The boundary conditions of the rock for the particles next to its boundary (particles_at_faces()). A particle obeys the
/// condition of its face, as a node on the face does. Where conditions meet, fixed takes precedence over velocity and velocity
/// over roller, as for nodes.
class ParticleBoundary
{
public:
  /// @param spacing of the points of the surface [m], fem::Settings::surface_spacing
  ParticleBoundary(const fem::Mesh &mesh, const fem::Material &rock, const std::vector<fem::BoundaryCondition> &conditions,
                   const dem::Packing &packing, double spacing);

  /// Share of an absorbing face: force = -area (Z_p v_n + Z_s v_t).
  struct Dashpot
  {
    Eigen::Vector3d normal; ///< of the face
    double area;            ///< reference area times weight [m^2], 2D [m]
  };
  /// Boundary conditions of one particle.
  struct Role
  {
    bool held = false;                                     ///< displacement and rotation are prescribed
    int driver = -1;                                       ///< held: condition that gives the velocity; -1: at rest
    std::array<bool, 3> blocked = {{false, false, false}}; ///< not held: directions of rollers
    std::vector<Dashpot> dashpots;                         ///< for the present weights

    bool free() const { return !held && !blocked[0] && !blocked[1] && !blocked[2] && dashpots.empty(); }
  };
  const Role &role(int index) const { return roles[index]; } ///< by index in the packing
  double impedance_p() const { return Z_p; }                 ///< rho c_p [Pa s/m]
  double impedance_s() const { return Z_s; }                 ///< rho c_s [Pa s/m]

  /// Absorbing faces: their owner sets the weights and calls update_dashpots().
  std::vector<TributaryAreas> &absorbing_areas() { return absorbing_sides; }
  void update_dashpots();

  /// Adds the forces of the dashpots to the particles of this rank. Their work, which is negative, goes to @p absorbing, whose
  /// begin() was called.
  void damp(dem::Particles &particles, ParticleWork &absorbing);
  /// Holds or drives particles; call it after all other forces. The work on held and driven particles goes to @p work, whose
  /// begin() was called.
  /// @param time of the positions [s]
  /// @param dt step [s]
  void hold(dem::Particles &particles, double time, double dt, ParticleWork &work);

  /// The particles that can be tied to the finite elements: without held ones, and with the directions that rollers block.
  std::vector<TiedParticle> movable(const std::vector<TiedParticle> &particles) const;

  int n_particles() const { return n_on_boundary; }

private:
  std::vector<fem::BoundaryCondition> conditions;
  double Z_p, Z_s;
  int n_on_boundary = 0;
  std::vector<Role> roles; // by index in the packing
  std::vector<TributaryAreas> absorbing_sides;

  const std::vector<int> &on_this_rank(const dem::Particles &particles);

  std::uint64_t planned_order = ~0ull;
  std::vector<int> local; // particles of this rank with a role
};

/// Force of a dashpot on a particle [N]. Theory (9.18).
Eigen::Vector3d dashpot_force(const ParticleBoundary::Dashpot &dashpot, double impedance_p, double impedance_s,
                              const Eigen::Vector3d &velocity);
} // namespace kerf
