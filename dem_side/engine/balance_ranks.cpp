// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/balance_ranks.h"

#include "dem_side/engine/rank_borders.h"

#include <algorithm>
#include <atom.h>
#include <comm.h>
#include <domain.h>
#include <mpi.h>

namespace kerf::dem
{
void balance_ranks(LAMMPS_NS::LAMMPS &lmp, const std::vector<Eigen::Vector3d> &new_positions, double thinnest, bool at_once)
{
  constexpr int n_bins = 4096;
  constexpr double largest_imbalance = 1.1; // fullest rank by the mean
  LAMMPS_NS::Comm &comm = *lmp.comm;
  const LAMMPS_NS::Domain &domain = *lmp.domain;
  double *const splits[3] = {comm.xsplit, comm.ysplit, comm.zsplit};
  bool changed = false;
  for (int c = 0; c < domain.dimension; ++c)
  {
    if (comm.procgrid[c] == 1)
      continue;
    const double length = domain.boxhi[c] - domain.boxlo[c], thinnest_share = thinnest / length;
    const Borders now(splits[c], splits[c] + comm.procgrid[c] + 1);
    bool thick = true; // segments that are too thin already stay unchanged
    for (int k = 0; k < comm.procgrid[c]; ++k)
      thick = thick && now[k + 1] - now[k] >= thinnest_share;
    if (!thick)
      continue;
    std::vector<double> counts(n_bins, 0.);
    const auto add = [&](double x)
    { ++counts[std::clamp(static_cast<int>(n_bins * (x - domain.boxlo[c]) / length), 0, n_bins - 1)]; };
    for (int i = 0; i < lmp.atom->nlocal; ++i)
      add(lmp.atom->x[i][c]);
    MPI_Allreduce(MPI_IN_PLACE, counts.data(), n_bins, MPI_DOUBLE, MPI_SUM, lmp.world);
    for (const Eigen::Vector3d &position : new_positions) // after the sum over the ranks, because every rank knows them
      add(position[c]);
    if (imbalance(counts, now) <= largest_imbalance)
      continue;
    const Borders balanced = balanced_borders(counts, comm.procgrid[c], thinnest_share);
    const Borders next = at_once ? balanced : approach(now, balanced, thinnest_share);
    std::copy(next.begin(), next.end(), splits[c]);
    changed = true;
  }
  if (!changed)
    return;
  comm.uniform = 0; // tells LIGGGHTS to read the borders
  lmp.domain->set_local_box();
}
} // namespace kerf::dem
