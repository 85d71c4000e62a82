// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/overlap_links.h"

#include "coupler/input_error.h"

#include <algorithm>
#include <string>

namespace kerf
{
OverlapLinks::OverlapLinks(const dem::Packing &packing, WindowNodes window, MPI_Comm comm)
  : packing(packing), which(window), comm(comm)
{
}

void OverlapLinks::set_particles(const std::vector<TiedParticle> &particles)
{
  std::unordered_map<int, Row> kept;
  for (const TiedParticle &particle : particles)
    if (const auto known = rows.find(particle.index); known != rows.end())
    {
      known->second.share = particle.share;
      kept.insert(*known);
    }
  rows = std::move(kept);
  tied = particles;
  located = false;
  stale = true;
}

void OverlapLinks::locate(fem::FemSide &fem)
{
  std::vector<TiedParticle> pending;
  for (const TiedParticle &particle : tied)
    if (!rows.count(particle.index))
      pending.push_back(particle);
  Eigen::Matrix3Xd points(3, pending.size());
  for (std::size_t k = 0; k < pending.size(); ++k)
    points.col(k) = packing.positions.col(pending[k].index);
  const std::vector<fem::Interpolation> found = fem.locate(points);
  for (std::size_t k = 0; k < pending.size(); ++k)
  {
    if (found[k].cell < 0)
      throw InputError("stored particle " + std::to_string(pending[k].index) + " lies outside the mesh");
    Row row;
    row.share = pending[k].share;
    for (int a = 0; a < found[k].n; ++a)
      if (found[k].N[a] > 1e-12) // on a face only its own nodes count, whatever cell was found
      {
        row.node[row.n] = found[k].nodes[a];
        row.N[row.n++] = found[k].N[a];
      }
    rows.emplace(pending[k].index, row);
  }
  located = true;
}

bool OverlapLinks::update(const dem::Particles &particles, fem::FemSide &fem)
{
  // Windows are collective, so all ranks plan again when particles moved on any of them.
  int plan = stale || order != particles.order;
  MPI_Allreduce(MPI_IN_PLACE, &plan, 1, MPI_INT, MPI_MAX, comm);
  if (!plan)
    return false;
  if (!located)
    locate(fem);

  const auto n_nodes = static_cast<std::size_t>(fem.mesh().n_nodes());
  std::vector<int> column(n_nodes, -1);
  window.clear();
  const auto show = [&](int node)
  {
    if (column[node] < 0)
    {
      column[node] = static_cast<int>(window.size());
      window.push_back(node);
    }
    return column[node];
  };
  if (which == WindowNodes::all)
    for (const TiedParticle &particle : tied)
    {
      const Row &row = rows.at(particle.index);
      std::for_each(row.node.begin(), row.node.begin() + row.n, show);
    }

  list.clear();
  for (int i = 0; i < particles.n; ++i)
  {
    const auto found = rows.find(particles.index[i]);
    if (found == rows.end())
      continue;
    const Row &row = found->second;
    OverlapLink link;
    link.particle = i;
    link.share = row.share;
    link.n = row.n;
    link.N = row.N;
    std::transform(row.node.begin(), row.node.begin() + row.n, link.node.begin(), show);
    Eigen::Map<Eigen::Vector3d>(link.origin.data()) = packing.positions.col(particles.index[i]);
    list.push_back(link);
  }
  fem.set_window(window);
  order = particles.order;
  stale = false;
  return true;
}

std::vector<double> OverlapLinks::tied_masses(const dem::Particles &particles, fem::FemSide &fem) const
{
  Eigen::Matrix3Xd node_mass;
  fem.read_window(fem::NodalField::mass, node_mass);
  // The sum over j needs the particles of all ranks: pushed to the nodes as if it were a force, and read back.
  Eigen::Matrix3Xd before, shares = Eigen::Matrix3Xd::Zero(3, n_window()), total;
  fem.read_window(fem::NodalField::force, before);
  for (const OverlapLink &link : list)
    spread(link, Eigen::Vector3d::Constant(link.share), shares);
  fem.add_window_forces(shares);
  fem.read_window(fem::NodalField::force, total);
  fem.add_window_forces(-shares);
  total -= before;

  std::vector<double> masses;
  for (const OverlapLink &link : list)
  {
    double inverse = 1. / particles.mass[link.particle];
    bool massless_node = false;
    for (int a = 0; a < link.n; ++a)
    {
      const double m = node_mass(0, link.node[a]);
      massless_node = massless_node || m <= 0.;
      inverse += m > 0. ? link.N[a] * total(0, link.node[a]) / m : 0.;
    }
    masses.push_back(massless_node ? 0. : 1. / inverse);
  }
  return masses;
}
} // namespace kerf
