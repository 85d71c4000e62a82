// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/exchange/particle_interpolation.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <utility>

namespace kerf
{
ParticleInterpolation::ParticleInterpolation(const dem::Packing &packing, WindowNodes window, MPI_Comm comm)
  : packing(packing), which(window), comm(comm)
{
}

void ParticleInterpolation::set_particles(const std::vector<TiedParticle> &particles)
{
  const std::vector<Row> known = std::move(rows);
  const std::vector<int> known_row = std::move(row_of);
  rows.assign(particles.size(), {});
  row_of.assign(packing.size(), -1);
  for (std::size_t k = 0; k < particles.size(); ++k)
  {
    const int index = particles[k].index;
    if (!known_row.empty() && known_row[index] >= 0)
      rows[k] = known[known_row[index]];
    rows[k].share = particles[k].share;
    row_of[index] = static_cast<int>(k);
  }
  tied = particles;
  located = false;
  stale = true;
}

void ParticleInterpolation::locate(fem::FemSide &fem)
{
  std::vector<int> pending; // rows not found yet have no nodes
  for (std::size_t k = 0; k < tied.size(); ++k)
    if (rows[k].n == 0)
      pending.push_back(static_cast<int>(k));
  Eigen::Matrix3Xd points(3, pending.size());
  for (std::size_t k = 0; k < pending.size(); ++k)
    points.col(k) = packing.positions.col(tied[pending[k]].index);
  const std::vector<fem::Interpolation> found = fem.locate(points);
  for (std::size_t k = 0; k < pending.size(); ++k)
  {
    if (found[k].cell < 0)
      throw std::logic_error("stored particle " + std::to_string(tied[pending[k]].index) + " lies outside the mesh");
    constexpr double nothing = 1e-12; // on a face only the nodes of the face enter, in whichever cell the point was found
    Row &row = rows[pending[k]];
    row.cell = found[k].cell;
    for (int d = 0; d < 3; ++d)
      row.xi[d] = found[k].xi[d] < nothing ? 0. : found[k].xi[d] > 1. - nothing ? 1. : found[k].xi[d];
    for (int a = 0; a < found[k].n; ++a)
      if (found[k].N[a] > nothing)
      {
        row.node[row.n] = found[k].nodes[a];
        row.N[row.n++] = found[k].N[a];
      }
  }
  located = true;
}

InterpolationChange ParticleInterpolation::update(const dem::Particles &particles, fem::FemSide &fem)
{
  // Setting a nodal window is collective, so all ranks renew their entries if one of them has to.
  int change = static_cast<int>(stale                      ? InterpolationChange::renewed
                                : order != particles.order ? InterpolationChange::renumbered
                                                           : InterpolationChange::none);
  MPI_Allreduce(MPI_IN_PLACE, &change, 1, MPI_INT, MPI_MAX, comm);
  if (change == static_cast<int>(InterpolationChange::renumbered))
  {
    int same = renumber(particles);
    MPI_Allreduce(MPI_IN_PLACE, &same, 1, MPI_INT, MPI_MIN, comm);
    change = static_cast<int>(same ? InterpolationChange::renumbered : InterpolationChange::renewed);
  }
  if (change == static_cast<int>(InterpolationChange::renewed))
    renew(particles, fem);
  order = particles.order;
  stale = false;
  return static_cast<InterpolationChange>(change);
}

/// Updates the particle numbers of the entries. Returns false when this rank has other tied particles than before.
bool ParticleInterpolation::renumber(const dem::Particles &particles)
{
  std::vector<int> particle_of(rows.size(), -1);
  std::size_t n = 0;
  for (int i = 0; i < particles.n; ++i)
    if (const int row = row_of[particles.index[i]]; row >= 0)
    {
      particle_of[row] = i;
      ++n;
    }
  bool same = n == list.size();
  for (InterpolatedParticle &entry : list)
  {
    entry.particle = particle_of[entry.row];
    same = same && entry.particle >= 0;
  }
  return same;
}

void ParticleInterpolation::renew(const dem::Particles &particles, fem::FemSide &fem)
{
  if (!located)
    locate(fem);

  column_of.assign(fem.mesh().n_nodes(), -1);
  shown.clear();
  const auto show = [&](int node)
  {
    if (column_of[node] < 0)
    {
      column_of[node] = static_cast<int>(shown.size());
      shown.push_back(node);
    }
    return column_of[node];
  };
  if (which == WindowNodes::all)
    for (const Row &row : rows)
      std::for_each(row.node.begin(), row.node.begin() + row.n, show);

  list.clear();
  for (int i = 0; i < particles.n; ++i)
  {
    const int place = row_of[particles.index[i]];
    if (place < 0)
      continue;
    const Row &row = rows[place];
    InterpolatedParticle entry;
    entry.particle = i;
    entry.row = place;
    entry.share = row.share;
    entry.blocked = tied[place].blocked;
    entry.cell = row.cell;
    entry.xi = row.xi;
    entry.n = row.n;
    entry.N = row.N;
    std::transform(row.node.begin(), row.node.begin() + row.n, entry.node.begin(), show);
    Eigen::Map<Eigen::Vector3d>(entry.origin.data()) = packing.positions.col(particles.index[i]);
    list.push_back(entry);
  }
  n_carrier_nodes = n_window();
  if (nodes_around)
    for (int a = 0; a < n_carrier_nodes; ++a)
      for (const int node : nodes_around(shown[a]))
        show(node);
  fem.set_window(shown);
}

std::vector<double> ParticleInterpolation::tied_masses(const dem::Particles &particles, fem::FemSide &fem) const
{
  Eigen::Matrix3Xd node_mass;
  fem.read_window(fem::NodalField::mass, node_mass);
  // The sum over j includes the particles of all ranks. It is assembled at the nodes like a force and read back.
  Eigen::Matrix3Xd before, shares = Eigen::Matrix3Xd::Zero(3, n_window()), total;
  fem.read_window(fem::NodalField::force, before);
  for (const InterpolatedParticle &entry : list)
    spread(entry, Eigen::Vector3d::Constant(entry.share), shares);
  fem.add_window_forces(shares);
  fem.read_window(fem::NodalField::force, total);
  fem.add_window_forces(-shares);
  total -= before;

  std::vector<double> masses;
  for (const InterpolatedParticle &entry : list)
  {
    double inverse = 1. / particles.mass[entry.particle];
    bool massless_node = false;
    for (int a = 0; a < entry.n; ++a)
    {
      const double m = node_mass(0, entry.node[a]);
      massless_node = massless_node || m <= 0.;
      inverse += m > 0. ? entry.N[a] * total(0, entry.node[a]) / m : 0.;
    }
    masses.push_back(massless_node ? 0. : 1. / inverse);
  }
  return masses;
}
} // namespace kerf
