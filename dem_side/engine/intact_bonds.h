// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/particle_rows.h"

#include <vector>

namespace kerf::dem
{
/// The intact bonds of the neighbour lists, packed: what changes in a step is in the rows of the particles alone, because the
/// law has no history. Several bonds are computed at once. The lists of the particle engine stay the owner of the bonds; this
/// is a copy for the time between two list builds.
template <int dim>
class IntactBonds
{
public:
  /// Where a bond is kept in the neighbour lists: n-th neighbour of a particle.
  struct Place
  {
    int particle = -1, neighbour = -1;
  };
  /// A bond that fails, before its loads are added.
  struct Failing
  {
    Place place;
    law::Failure failure;
  };
  struct Bond
  {
    int first, second;       ///< rows, in an order that all ranks agree on, so that they compute the same bits
    law::Vector<dim> normal; ///< from the first to the second particle as stored
    double rest_length;      ///< [m]
    double weight;           ///< [-]
    double rolling;          ///< see rolling_resistance()
    double viscosity;        ///< normal [N s/m]
    Place place;
  };

  /// Takes the bonds over. Neighbours in the list should be neighbours in space.
  void assign(const std::vector<Bond> &bonds);

  std::size_t size() const { return places.size(); } ///< and a few idle ones

  /// Adds the loads of all bonds to the rows.
  /// @param reach distance / sum of radii up to which a bond is in the neighbour lists
  /// @param on_failure called as on_failure(Failing) in a step for bonds at their strength; they are dropped.
  /// @return whether a bond is longer than the reach or not a number.
  template <bool damped, typename OnFailure>
  bool add_loads(std::vector<ParticleRow<dim>> &rows, const BondParameters &bond, double reach, bool step,
                 const OnFailure &on_failure);

private:
  struct Batch
  {
    law::Vector<dim, Lanes> normal;
    Lanes rest_length, weight;
    LaneRows first, second;
  };
  void drop(std::size_t batch, int lane);

  std::vector<Batch> batches;
  std::vector<Lanes> viscosities; ///< of each batch; apart because they are not read without damping
  std::vector<Lanes> rolling;     ///< not read without weights
  std::vector<Place> places;      ///< of each lane of each batch, read on failure only
};

template <int dim>
void IntactBonds<dim>::assign(const std::vector<Bond> &bonds)
{
  // Each lane takes a stretch of the list: the lanes of a batch belong to different particles, so that no lane waits for the
  // sum that the one before has just written, but not to far ones, whose rows would not be in the cache together.
  constexpr std::size_t stretch = 4096;
  const std::size_t n = (bonds.size() + Lanes::size - 1) / Lanes::size;
  batches.resize(n);
  viscosities.resize(n);
  rolling.resize(n);
  places.resize(Lanes::size * n);
  for (std::size_t batch = 0; batch < n; ++batch)
    for (int lane = 0; lane < Lanes::size; ++lane)
    {
      const std::size_t begin = batch / stretch * stretch, here = std::min(stretch, n - begin);
      const std::size_t k = Lanes::size * begin + lane * here + batch - begin;
      const Bond &bond = bonds[std::min(k, bonds.size() - 1)];
      Batch &b = batches[batch];
      for (int c = 0; c < dim; ++c)
        b.normal[c].set(lane, bond.normal[c]);
      b.rest_length.set(lane, bond.rest_length);
      b.weight.set(lane, bond.weight);
      viscosities[batch].set(lane, bond.viscosity);
      rolling[batch].set(lane, bond.rolling);
      b.first.template set<ParticleRow<dim>>(lane, bond.first);
      b.second.template set<ParticleRow<dim>>(lane, bond.second);
      places[Lanes::size * batch + lane] = bond.place;
      if (k >= bonds.size())
        drop(batch, lane);
    }
}

/// Makes the lane idle: a bond without load and far from failure between the same particles.
template <int dim>
void IntactBonds<dim>::drop(std::size_t batch, int lane)
{
  for (int c = 0; c < dim; ++c)
    batches[batch].normal[c].set(lane, 0.);
  batches[batch].rest_length.set(lane, 1e30);
  batches[batch].weight.set(lane, 0.);
  viscosities[batch].set(lane, 0.);
  rolling[batch].set(lane, 0.);
}

template <int dim>
template <bool damped, typename OnFailure>
bool IntactBonds<dim>::add_loads(std::vector<ParticleRow<dim>> &particle_rows, const BondParameters &bond, double reach,
                                 bool step, const OnFailure &on_failure)
{
  ParticleRow<dim> *rows = particle_rows.data();
  const Lanes tangential_share = std::sqrt(bond.k_t / bond.k_n);
  Lanes::Mask overstretched = {};
  for (std::size_t k = 0; k < batches.size(); ++k)
  {
    const Batch &batch = batches[k];
    if constexpr (dim == 3) // in two dimensions the rows that are soon needed are in the cache anyway
      prefetch<damped>(rows, batches[std::min(k + 8, batches.size() - 1)].second);
    const auto first = gather<damped>(rows, batch.first), second = gather<damped>(rows, batch.second);
    const auto pair =
      law::make_pair<dim, Lanes>(first.position, second.position, first.weighted_radius, second.weighted_radius);
    law::Vector<dim, Lanes> normal_first = first.turn * batch.normal, normal_second = second.turn * batch.normal;
    auto strain = law::bond_strain<dim, Lanes>(pair, batch.rest_length, normal_first, normal_second);
    if (step)
    {
      const Lanes::Mask tension = law::fails_in_tension(strain, bond);
      Lanes::Mask failing = tension | law::fails_in_shear(strain, bond);
      if (__builtin_expect(any(failing), false))
        failing &= batch.weight >= bond.breaking_weight;
      if (__builtin_expect(any(failing), false))
      {
        for (int lane = 0; lane < Lanes::size; ++lane)
          if (failing[lane])
          {
            drop(k, lane);
            on_failure(Failing{places[Lanes::size * k + lane], tension[lane] ? law::Failure::tension : law::Failure::shear});
          }
        --k; // once more without them
        continue;
      }
    }
    // Both sides times the weight, which is zero in idle lanes.
    overstretched |= ~(batch.weight * (strain.elongation + batch.rest_length) <
                       Lanes(reach) * (first.weighted_radius + second.weighted_radius));

    auto elastic = law::bond_load<dim, Lanes>(pair, strain, batch.rest_length, normal_first, normal_second, bond, batch.weight);
    if (any(batch.weight < 1.))
    {
      const auto torque = law::rolling_torque<dim, Lanes>(rolling[k], batch.rest_length, normal_first, normal_second, bond);
      elastic.torque_first += torque;
      elastic.torque_second -= torque;
    }
    if constexpr (damped)
    {
      const law::Vector<dim, Lanes> v =
        law::contact_velocity<dim, Lanes>(pair, first.velocity, second.velocity, first.spin, second.spin);
      const Lanes c = viscosities[k], c_t = tangential_share * c;
      const law::Vector<dim, Lanes> force = c_t * v + ((c - c_t) * pair.normal.dot(v)) * pair.normal;
      const auto viscous = law::contact_point_load<dim, Lanes>(pair, force);
      add(rows, batch.first, {elastic.force, elastic.torque_first}, {viscous.force, viscous.torque_first});
      add(rows, batch.second, {-elastic.force, elastic.torque_second}, {-viscous.force, viscous.torque_second});
    }
    else
    {
      add(rows, batch.first, {elastic.force, elastic.torque_first});
      add(rows, batch.second, {-elastic.force, elastic.torque_second});
    }
  }
  return any(overstretched);
}
} // namespace kerf::dem
