// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_settings.h"
#include "dem_side/particle_types.h"

#include <cstdint>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

namespace kerf::dem
{
/// The particles: a LIGGGHTS instance with the rock bond. Misuse of a function is a std::logic_error, a particle or bond that
/// ran away is Unstable, see errors.h.
///
/// All functions are collective unless stated; totals are the same on every rank.
class DemSide
{
public:
  /// Throws std::invalid_argument when a setting is out of range.
  explicit DemSide(const Settings &settings);
  ~DemSide();
  DemSide(const DemSide &) = delete;
  DemSide &operator=(const DemSide &) = delete;

  /// Takes particles out of the store. @p particles is the same list on every rank; none of them may be taken. Bonds of the
  /// store between a new and any active particle are created in the state that the displacements give them. Follow with
  /// set_weights() and setup(). Throws Unstable when a state is not finite or outside of the domain.
  /// @param broken stored bonds of new particles to active ones that are not created: they count as broken. A new particle
  /// that overlaps an older one without a bond starts without force. Theory (3.18)
  void insert(const std::vector<NewParticle> &particles, const std::vector<StoredPair> &broken = {});

  /// Stored bonds between @p particles, which are not active, and active particles that are no longer where a field expects
  /// them: their deformation differs from the expected one by more than the bond can bear. Theory (7.20)
  /// @param expected the state by the field of active partners, by index in the packing
  /// Each bond on exactly one rank. Not collective.
  std::vector<StoredPair> misfitting_bonds(const std::vector<NewParticle> &particles,
                                           const std::unordered_map<int, NewParticle> &expected) const;

  /// Puts active particles back into the store, the same list on every rank. They can be inserted again. Their bonds and
  /// contacts are forgotten, so none of them should have a broken bond. Follow with set_weights() and setup().
  void remove(const std::vector<int> &particles);

  /// Weight of the discrete model in [0, 1] for every particle of the store; only those of active particles are read. A contact
  /// has the weight of its point, see bond_weight(). A particle's mass is its full mass times the mean weight of its stored
  /// bonds to active particles, which keeps its frequency below that of the unweighted packing. A weight of zero is allowed for
  /// a particle that is bonded to one with weight, at the outer end of an overlap. Follow with setup() or compute_forces().
  void set_weights(const Eigen::VectorXd &weight);

  /// Keeps set_weights(@p weight) from bringing in energy through particles that have come off the field of the finite
  /// elements. Contacts whose weight grows become softer, so that their forces do not change then: at the full stiffness their
  /// overlap would hold more. Theory (7.24). Bonds break whose deformation would change by more than they can bear, since their
  /// contact points move with the weights of their ends. Theory (7.25). To be called before insert() and remove().
  /// @param leaving particles that remove() will take out; their bonds are left alone
  void prepare_weights(const Eigen::VectorXd &weight, const std::vector<int> &leaving = {});

  /// Weighted masses [kg] of the particles of this rank, in the order of particles(), that setup() will give them if
  /// insert(@p added) and set_weights(@p weight) are called before.
  std::vector<double> masses_with(const std::vector<NewParticle> &added, const Eigen::VectorXd &weight) const;

  /// Exchanges particles between ranks, builds the lists, creates pending bonds and computes all forces at the present
  /// positions without a step. Throws Unstable when bonds cannot be created because their particles are displaced too far.
  void setup(const ForceHook &hook);

  /// Computes all forces with the lists of the last setup(), for particles that have since moved by less than half of their
  /// skin.
  void compute_forces(const ForceHook &hook);

  /// Advances by @p steps steps. Without any active particle only the hook is called, with no particles. Throws Unstable when
  /// an intact bond is longer than the neighbour lists reach, which is far beyond its strength.
  void advance(int steps, const ForceHook &hook);

  Particles particles();                      ///< not collective
  int n_active() const;                       ///< over all ranks
  const std::vector<char> &is_active() const; ///< by index in the packing, same on every rank. Not collective
  /// By index in the packing: taken out of the store, whether active or gone from the domain. Not collective
  const std::vector<char> &is_taken() const;
  /// Indices in the packing of the particles that left the domain since the start, in the order of leaving. Not collective
  const std::vector<int> &left_domain() const;

  std::int64_t n_bonds_intact() const;
  std::int64_t n_bonds_broken() const;          ///< since the start
  std::vector<BrokenBond> broken_bonds() const; ///< of this rank (each bond on exactly one rank), since the start
  /// Bonds of this rank (each bond on exactly one rank). @p target by index in the packing: only those with a target end;
  /// empty: all. Not collective
  std::vector<ActiveBond> bonds(const std::vector<char> &target = {}) const;
  Energies energies() const;

  /// Of each particle of this rank: broken bonds / stored bonds, in [0, 1].
  std::vector<double> damage() const;

private:
  struct Engine;
  std::unique_ptr<Engine> engine;
};

/// Version string of the particle library.
std::string library_version();
} // namespace kerf::dem
