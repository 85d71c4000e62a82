// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/tied_particle.h"
#include "coupler/energy/particle_work.h"
#include "coupler/loading/tool/tool.h"
#include "dem_side/dem_side.h"
#include "dem_side/packing/stored_bonds.h"
#include "fem_side/fem_side.h"

#include <unordered_map>
#include <vector>

namespace kerf
{
/// Particles that have come off the rock lie on what is left of the finite elements: contact of loose particles with the outer
/// surface, with the stiffness of contacts between particles by the weight of the surface. Particles that belong to the rock
/// need none, ties and bonds hold them. The reaction acts at the surface point next to the contact, up to a patch radius off.
class DebrisContact
{
public:
  /// @param packing kept by reference. @param dt step [s]
  DebrisContact(const dem::BondParameters &bond, const dem::Packing &packing, double dt, MPI_Comm comm);

  /// Finds the loose particles: no chain of intact bonds leads from them to a tied one. Looks only when bonds broke or models
  /// changed since the last call. @param bonds of the store. Collective.
  void find_debris(const dem::DemSide &dem, const dem::StoredBonds &bonds, const std::vector<TiedParticle> &ties);

  /// Contact forces on particles and surface, for the present positions. @p work counts those on the particles, its begin() was
  /// called. Collective.
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem, ParticleWork &work);

  double stored() const { return elastic; }                            ///< in the contacts of this rank [J]
  bool is_debris(int index) const { return loose[index]; }             ///< by index in the packing
  int n_debris() const { return n_debris_particles; }                  ///< over all ranks
  int n_near_surface() const { return static_cast<int>(near.size()); } ///< candidates for contact, over all ranks

private:
  /// A loose particle as the ranks that own the surface see it.
  struct Visitor
  {
    int index;
    Eigen::Vector3d position, velocity, spin;
    double radius, mass;
  };
  std::vector<Visitor> visitors(const dem::Particles &particles, const std::vector<char> &which) const;
  void find_near(const dem::Particles &particles, const fem::FemSide &fem);
  /// What a particle touches: a surface point stands for the flat patch around it.
  struct Touch
  {
    double distance = 1e300; ///< of the particle's centre [m]
    int point = -1;
    Eigen::Vector3d arm = Eigen::Vector3d::Zero(); ///< from the centre to the nearest place of the patch [m]
  };
  Touch nearest(const Visitor &visitor) const;
  double follow(const Visitor &visitor, double distance);
  /// Surface points of the finite elements of this rank around the visitors, sorted into bins.
  void find_points(const std::vector<Visitor> &all, const fem::FemSide &fem, double reach);
  template <typename Visit>
  void for_each_point_near(const Eigen::Vector3d &position, double reach, const Visit &visit) const;
  Eigen::Vector3i bin_of(const Eigen::Vector3d &position) const;

  const dem::Packing &packing;
  double dt;
  MPI_Comm comm;
  int rank = 0;
  ContactLaw law;
  double stiffness; // of a contact [N/m]
  double damping;   // fraction of critical [-]
  double patch;     // radius [m]; patches of neighbouring points overlap

  std::vector<char> loose, near_surface; // by index in the packing, the same on every rank
  int n_debris_particles = 0;
  std::int64_t broken_seen = -1;
  int active_seen = -1, ties_seen = -1;
  std::vector<int> near; // loose ones close to the surface, ascending
  /// What is remembered of a loose particle [m].
  struct Memory
  {
    double embedded = 0.; ///< how deep it lay in the surface when it came to it from within the rock
    double overlap = 0.;  ///< beyond that, in the step before
  };
  std::unordered_map<int, Memory> memory;
  int steps_until_look = 0;
  double elastic = 0.;

  fem::SurfacePoints points;
  Eigen::Matrix3Xd point_force;
  Eigen::Vector3d origin;
  double bin_size = 1.;
  Eigen::Vector3i n_bins;
  std::vector<int> bin_start, bin_points;
};
} // namespace kerf
