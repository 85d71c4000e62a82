// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/gather.h"
#include "coupler/link_cells.h"

namespace kerf
{
/// The loads that a constraint puts on tied particles in a step, kept for their work by the trapezoidal rule over the steps
/// (see OuterWork): forces act at the point of the finite elements that a particle is tied to, so those that are not along chi
/// come with a couple. A step's hook sees one velocity, at which the loads of the step before end their way and the new ones
/// begin theirs: what they do is summed where the velocities are at hand.
template <int dim>
class TieLoads
{
public:
  static constexpr int n_turns = dim == 2 ? 1 : 3; ///< components of a rotation

  std::vector<std::array<LinkLanes, dim>> force; ///< of each batch, on the particles [N]

  /// For new links of this rank: without loads.
  void renew(const LinkCells<dim> &cells, const dem::Particles &particles)
  {
    force.assign(cells.batches().size(), {});
    couple.assign(force.size(), {});
    index.resize(force.size());
    for (std::size_t k = 0; k < force.size(); ++k)
      for (int l = 0; l < n_link_lanes; ++l)
        index[k][l] = particles.index[cells.batches()[k].particle[l]];
  }

  /// Adds the couples -chi x force of a batch to its particles. Returns the power of those before and these [W].
  LinkLanes add_couples(std::size_t k, const std::array<LinkLanes, dim> &chi, const LinkCells<dim> &cells,
                        dem::Particles &particles)
  {
    const auto &f = force[k];
    const int *particle = cells.batches()[k].particle;
    LinkLanes power = {};
    for (int t = 0; t < n_turns; ++t)
    {
      const int c = axis(t), next = (c + 1) % 3, last = (c + 2) % 3;
      const LinkLanes now = chi[last] * f[next] - chi[next] * f[last];
      power += (couple[k][t] + now) * load_lanes(particles.angular_velocity.data(), particle, c);
      couple[k][t] = now;
      subtract_lanes(particles.torque.data(), particle, c, -now);
    }
    return power;
  }

  /// After the links were updated: brings @p cells to the particles' new places. The loads of the step before are known to the
  /// next ones when the links are the same; otherwise returns their work over the second half of their way [J]. In a setup
  /// there is none, its forces take the place of those before. Collective.
  double follow(dem::Phase phase, LinkChange change, const OverlapLinks &links, LinkCells<dim> &cells,
                const dem::Particles &particles, double dt, int n_stored, MPI_Comm comm) const
  {
    if (change == LinkChange::renumbered)
      cells.renumber(links);
    return phase == dem::Phase::step && change == LinkChange::renewed ? half_way_of_moved(cells, particles, dt, n_stored, comm)
                                                                      : 0.;
  }

private:
  /// Work over half a step at the particles' present velocities, wherever these went [J]; @p cells are those of before.
  /// Collective.
  double half_way_of_moved(const LinkCells<dim> &cells, const dem::Particles &particles, double dt, int n_stored,
                           MPI_Comm comm) const
  {
    constexpr int record = 1 + dim + n_turns; // index, force, couple
    std::vector<double> mine;
    for (std::size_t k = 0; k < force.size(); ++k)
      for (int l = 0; l < n_link_lanes; ++l)
        if (cells.is_used(k, l))
        {
          mine.push_back(index[k][l]);
          for (int c = 0; c < dim; ++c)
            mine.push_back(force[k][c][l]);
          for (int t = 0; t < n_turns; ++t)
            mine.push_back(couple[k][t][l]);
        }
    const std::vector<double> all = gather_all(mine, MPI_DOUBLE, comm);
    std::vector<int> local(n_stored, -1);
    for (int i = 0; i < particles.n; ++i)
      local[particles.index[i]] = i;
    double sum = 0.;
    for (std::size_t at = 0; at < all.size(); at += record)
      if (const int i = local[static_cast<int>(all[at])]; i >= 0)
      {
        for (int c = 0; c < dim; ++c)
          sum += all[at + 1 + c] * particles.velocity(c, i);
        for (int t = 0; t < n_turns; ++t)
          sum += all[at + 1 + dim + t] * particles.angular_velocity(axis(t), i);
      }
    return 0.5 * dt * sum;
  }

  static constexpr int axis(int turn) { return dim == 2 ? 2 : turn; }

  std::vector<std::array<LinkLanes, n_turns>> couple; // [N m]
  std::vector<std::array<int, n_link_lanes>> index;   // of the particles, in the packing
};
} // namespace kerf
