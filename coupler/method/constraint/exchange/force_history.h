// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mpi_helpers.h"
#include "coupler/method/constraint/exchange/cell_batches.h"

namespace kerf
{
/// Constraint forces on tied particles, stored for their work by the trapezoidal rule over the steps (see ParticleWork). At the
/// velocity of the hook the second half of the work of the previous forces ends and the first half of the work of the new
/// forces begins. The power of both is summed where the velocities are loaded. The next velocity is not known there, because
/// damping follows.
template <int dim>
class ForceHistory
{
public:
  [[gnu::always_inline]] void fetch_after(int batch) const { kerf::fetch_after(force, n_packs<dim> * batch, n_packs<dim>); }
  /// Stores new forces on a pack of particles [N]. Returns the sum of the previous and the new forces.
  [[gnu::always_inline]] SimdPack exchange(std::size_t pack, const SimdPack &forces)
  {
    const SimdPack both = widened(force[pack]) + forces;
    force[pack] = narrowed(forces);
    return both;
  }

  /// To be called for new tied particles of this rank. Their forces are zero.
  void renew(const CellBatches<dim> &cells, const dem::Particles &particles)
  {
    force.assign(n_packs<dim> * cells.batches().size(), FloatPack{});
    index.resize(cells.batches().size());
    for (std::size_t k = 0; k < index.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        index[k][l] = particles.index[cells.batches()[k].particle(l)];
  }

  /// To be called after the tied particles were updated. Adapts @p cells to the new positions of particles in their arrays. If
  /// the tied particles of a rank changed, returns the work of the previous forces over their second half step [J]; otherwise
  /// exchange() accounts for it and the result is zero. In a setup the result is zero, since its forces replace the previous
  /// ones. Collective.
  double follow(dem::Phase phase, InterpolationChange change, const ParticleInterpolation &interpolation,
                CellBatches<dim> &cells, const dem::Particles &particles, double dt, int n_stored, MPI_Comm comm) const
  {
    if (change == InterpolationChange::renumbered)
      cells.renumber(interpolation);
    return phase == dem::Phase::step && change == InterpolationChange::renewed
             ? half_way_of_moved(cells, particles, dt, n_stored, comm)
             : 0.;
  }

private:
  /// Work of the previous forces over half a step at the present velocities of the particles [J], also of those that changed
  /// rank. @param cells of the previous step. Collective.
  double half_way_of_moved(const CellBatches<dim> &cells, const dem::Particles &particles, double dt, int n_stored,
                           MPI_Comm comm) const
  {
    constexpr int record = 1 + dim; // index, force
    std::vector<double> of_rank;
    for (std::size_t k = 0; k < index.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        if (cells.is_used(k, l))
        {
          of_rank.push_back(index[k][l]);
          const FloatPack &pack = force[n_packs<dim> * k + l / PackedVectors<dim>::n_entries];
          for (int c = 0; c < dim; ++c)
            of_rank.push_back(pack[PackedVectors<dim>::components * (l % PackedVectors<dim>::n_entries) + c]);
        }
    const std::vector<double> all = gather_all(of_rank, MPI_DOUBLE, comm);
    std::vector<int> local(n_stored, -1);
    for (int i = 0; i < particles.n; ++i)
      local[particles.index[i]] = i;
    double sum = 0.;
    for (std::size_t at = 0; at < all.size(); at += record)
      if (const int i = local[static_cast<int>(all[at])]; i >= 0)
        for (int c = 0; c < dim; ++c)
          sum += all[at + 1 + c] * particles.velocity(c, i);
    return 0.5 * dt * sum;
  }

  std::vector<FloatPack> force;                     // on the particles, for each pack of each batch [N]
  std::vector<std::array<int, n_simd_lanes>> index; // indices of the particles in the packing
};
} // namespace kerf
