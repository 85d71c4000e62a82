// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mpi_helpers.h"
#include "coupler/method/constraint/exchange/cell_batches.h"

namespace kerf
{
/// The forces that a constraint puts on tied particles in a step, kept for their work by the trapezoidal rule over the steps
/// (see ParticleWork). A step's hook sees one velocity, at which the forces of the step before end their way and the new ones
/// begin theirs: what they do is summed where the velocities are at hand. (Velocities ahead are not known: damping comes
/// after.)
template <int dim>
class ForceHistory
{
public:
  [[gnu::always_inline]] void fetch_after(int batch) const { kerf::fetch_after(force, n_packs<dim> * batch, n_packs<dim>); }
  /// Takes new forces on a pack of particles [N]. Returns those of the step before and these.
  [[gnu::always_inline]] SimdPack exchange(std::size_t pack, const SimdPack &forces)
  {
    const SimdPack both = widened(force[pack]) + forces;
    force[pack] = narrowed(forces);
    return both;
  }

  /// For new entries of this rank: without forces.
  void renew(const CellBatches<dim> &cells, const dem::Particles &particles)
  {
    force.assign(n_packs<dim> * cells.batches().size(), FloatPack{});
    index.resize(cells.batches().size());
    for (std::size_t k = 0; k < index.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        index[k][l] = particles.index[cells.batches()[k].particle(l)];
  }

  /// After the entries were updated: brings @p cells to the particles' new places. The forces of the step before are known to
  /// the next ones when the entries are the same; otherwise returns their work over the second half of their way [J]. In a
  /// setup there is none, its forces take the place of those before. Collective.
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
  /// Work over half a step at the particles' present velocities, wherever these went [J]; @p cells are those of before.
  /// Collective.
  double half_way_of_moved(const CellBatches<dim> &cells, const dem::Particles &particles, double dt, int n_stored,
                           MPI_Comm comm) const
  {
    constexpr int record = 1 + dim; // index, force
    std::vector<double> mine;
    for (std::size_t k = 0; k < index.size(); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        if (cells.is_used(k, l))
        {
          mine.push_back(index[k][l]);
          const FloatPack &pack = force[n_packs<dim> * k + l / PackedVectors<dim>::interpolation];
          for (int c = 0; c < dim; ++c)
            mine.push_back(pack[PackedVectors<dim>::components * (l % PackedVectors<dim>::interpolation) + c]);
        }
    const std::vector<double> all = gather_all(mine, MPI_DOUBLE, comm);
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

  std::vector<FloatPack> force;                     // of each pack of each batch, on the particles [N]
  std::vector<std::array<int, n_simd_lanes>> index; // of the particles, in the packing
};
} // namespace kerf
