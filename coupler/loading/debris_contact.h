// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/tied_particle.h"
#include "coupler/energy/particle_work.h"
#include "coupler/loading/contact_law.h"
#include "dem_side/dem_side.h"
#include "dem_side/geometry/grid.h"
#include "dem_side/packing/stored_bonds.h"
#include "fem_side/fem_side.h"

#include <unordered_map>
#include <vector>

namespace kerf
{
/// Contact of debris with the finite elements. Debris are particles that have come off the rock: they lie on the surface that
/// is left of the finite elements. Particles of the rock need no such contact, since ties and bonds hold them. The stiffness is
/// that of a contact between particles times the weight of the surface. The reaction acts at the surface point next to the
/// contact, which is at most a patch radius away (surface_resolution::patch_radius()).
class DebrisContact
{
public:
  /// @param bond stiffness, friction and damping of contacts between particles
  /// @param packing kept by reference
  /// @param dt step [s]
  DebrisContact(const dem::BondParameters &bond, const dem::Packing &packing, double dt, MPI_Comm comm);

  /// Finds the debris: particles from which no chain of intact bonds leads to a tied one. Does nothing unless bonds broke or
  /// models changed since the last call. Collective.
  /// @param bonds of the store
  void find_debris(const dem::DemSide &dem, const dem::StoredBonds &bonds, const std::vector<TiedParticle> &ties);

  /// Adds contact forces to particles and surface at the present positions. The work on the particles goes to @p work, whose
  /// begin() was called. Collective.
  void apply(dem::Phase phase, dem::Particles &particles, fem::SurfaceContact &surface, ParticleWork &work);

  double stored() const { return elastic; }                            ///< elastic energy of this rank's contacts [J]
  bool is_debris(int index) const { return debris[index]; }            ///< by index in the packing
  int n_debris() const { return n_debris_particles; }                  ///< over all ranks
  int n_near_surface() const { return static_cast<int>(near.size()); } ///< candidates for contact, over all ranks

private:
  /// A particle of the debris, known on every rank: its contact may be on another one than the particle itself.
  struct Fragment
  {
    int index;
    Eigen::Vector3d position, velocity, spin;
    double radius, mass;
  };
  std::vector<Fragment> gather(const dem::Particles &particles, const std::vector<char> &selected) const;
  void find_near(const dem::Particles &particles, const fem::SurfaceContact &surface);
  /// The nearest place of the surface. A surface point stands for the flat patch around it.
  struct Touch
  {
    double distance = 1e300; ///< from the fragment's centre [m]
    int point = -1;
    Eigen::Vector3d arm = Eigen::Vector3d::Zero(); ///< from the centre to the nearest place of the patch [m]
  };
  Touch nearest(const Fragment &fragment) const;
  double update_overlap(const Fragment &fragment, double distance);
  /// Surface points of the finite elements of this rank around the fragments, sorted into bins.
  void find_points(const std::vector<Fragment> &all, const fem::SurfaceContact &surface, double reach);
  template <typename Visit>
  void for_each_point_near(const Eigen::Vector3d &position, double reach, const Visit &visit) const;

  const dem::Packing &packing;
  double dt;
  MPI_Comm comm;
  int rank;
  ContactLaw law;
  double stiffness; // of a contact [N/m]
  double damping;   // fraction of critical [-]
  double patch;     // radius [m]; patches of neighbouring points overlap

  std::vector<char> debris, near_surface; // by index in the packing, the same on every rank
  int n_debris_particles = 0;
  std::int64_t broken_seen = -1;
  int active_seen = -1, ties_seen = -1;
  std::vector<int> near; // debris close to the surface, ascending
  /// State of a fragment's contact from one step to the next [m].
  struct ContactState
  {
    double embedded = 0.; ///< depth in the surface when it came there from within the rock
    double overlap = 0.;  ///< beyond that, in the step before
  };
  std::unordered_map<int, ContactState> states;
  int steps_until_search = 0;
  double elastic = 0.;

  fem::SurfacePoints points;
  Eigen::Matrix3Xd point_force;
  dem::Grid bins; // of the surface points
  dem::CellSort sorted;
};
} // namespace kerf
