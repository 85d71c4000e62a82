// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/particle_rows.h"

#include <vector>

namespace kerf::dem
{
/// The intact bonds of the neighbour lists, in SIMD packs that compute several bonds at once. The law has no history, so only
/// the rows of the particles change in a step. The lists of the particle engine own the bonds; this is a copy for the time
/// between two list builds.
template <int dim>
class IntactBonds
{
public:
  /// Position of a bond in the neighbour lists: n-th neighbour of a particle.
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
    int first, second;       ///< rows; the same order on all ranks, so that they compute the same bits
    law::Vector<dim> normal; ///< from the first to the second particle as stored
    double rest_length;      ///< [m]
    double weight;           ///< [-]
    double rolling;          ///< see rolling_resistance()
    double viscosity;        ///< normal [N s/m]
    Place place;
  };

  /// Copies the bonds. Neighbours in the list should be neighbours in space.
  void assign(const std::vector<Bond> &bonds);

  std::size_t size() const { return places.size(); } ///< including a few idle ones

  /// Adds the loads of all bonds to the rows.
  /// @param reach distance / sum of radii up to which a bond is in the neighbour lists
  /// @param on_failure called in a step as on_failure(Failing) for each bond that reaches its strength; the bond is removed.
  /// @return whether a bond is longer than the reach or not a number.
  template <bool damped, typename OnFailure>
  bool add_loads(std::vector<ParticleRow<dim>> &rows, const BondParameters &bond, double reach, bool step,
                 const OnFailure &on_failure);

private:
  struct Batch
  {
    law::Vector<dim, SimdPack> normal;
    SimdPack rest_length, weight;
    PackRows first, second;
  };
  void drop(std::size_t batch, int lane);

  std::vector<Batch> batches;
  std::vector<SimdPack> viscosities; ///< of each batch; separate, because they are not read without damping
  std::vector<SimdPack> rolling;     ///< of each batch; not read without weights
  std::vector<Place> places;         ///< of each lane of each batch, read on failure only
};

template <int dim>
void IntactBonds<dim>::assign(const std::vector<Bond> &bonds)
{
  // Each lane takes its own part of a stretch of the list. The lanes of a batch then belong to different particles, so no lane
  // waits for a sum that another one has just written. The stretch is short enough that their rows are in the cache together.
  constexpr std::size_t stretch = 4096;
  const std::size_t n = (bonds.size() + SimdPack::size - 1) / SimdPack::size;
  batches.resize(n);
  viscosities.resize(n);
  rolling.resize(n);
  places.resize(SimdPack::size * n);
  for (std::size_t batch = 0; batch < n; ++batch)
    for (int lane = 0; lane < SimdPack::size; ++lane)
    {
      const std::size_t begin = batch / stretch * stretch, here = std::min(stretch, n - begin);
      const std::size_t k = SimdPack::size * begin + lane * here + batch - begin;
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
      places[SimdPack::size * batch + lane] = bond.place;
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
  const SimdPack tangential_share = std::sqrt(bond.k_t / bond.k_n);
  SimdPack::Mask overstretched = {};
  for (std::size_t k = 0; k < batches.size(); ++k)
  {
    const Batch &batch = batches[k];
    if constexpr (dim == 3) // in two dimensions the next rows are in the cache anyway
      prefetch<damped>(rows, batches[std::min(k + 8, batches.size() - 1)].second);
    const auto first = gather<damped>(rows, batch.first), second = gather<damped>(rows, batch.second);
    const auto pair =
      law::make_pair<dim, SimdPack>(first.position, second.position, first.weighted_radius, second.weighted_radius);
    law::Vector<dim, SimdPack> normal_first = first.turn * batch.normal, normal_second = second.turn * batch.normal;
    auto strain = law::bond_strain<dim, SimdPack>(pair, batch.rest_length, normal_first, normal_second);
    if (step)
    {
      const SimdPack::Mask tension = law::fails_in_tension(strain, bond);
      SimdPack::Mask failing = tension | law::fails_in_shear(strain, bond);
      if (__builtin_expect(any(failing), false))
        failing &= batch.weight >= bond.breaking_weight;
      if (__builtin_expect(any(failing), false))
      {
        for (int lane = 0; lane < SimdPack::size; ++lane)
          if (failing[lane])
          {
            drop(k, lane);
            on_failure(Failing{places[SimdPack::size * k + lane], tension[lane] ? law::Failure::tension : law::Failure::shear});
          }
        --k; // repeat the batch without them
        continue;
      }
    }
    // Both sides are multiplied by the weight, which is zero in idle lanes.
    overstretched |= ~(batch.weight * (strain.elongation + batch.rest_length) <
                       SimdPack(reach) * (first.weighted_radius + second.weighted_radius));

    auto elastic =
      law::bond_load<dim, SimdPack>(pair, strain, batch.rest_length, normal_first, normal_second, bond, batch.weight);
    if (any(batch.weight < 1.))
    {
      const auto torque = law::rolling_torque<dim, SimdPack>(rolling[k], batch.rest_length, normal_first, normal_second, bond);
      elastic.torque_first += torque;
      elastic.torque_second -= torque;
    }
    if constexpr (damped)
    {
      const law::Vector<dim, SimdPack> v =
        law::contact_velocity<dim, SimdPack>(pair, first.velocity, second.velocity, first.spin, second.spin);
      const SimdPack c = viscosities[k], c_t = tangential_share * c;
      const law::Vector<dim, SimdPack> force = c_t * v + ((c - c_t) * pair.normal.dot(v)) * pair.normal;
      const auto viscous = law::contact_point_load<dim, SimdPack>(pair, force);
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
