// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/constraint.h"

#include <map>
#include <stdexcept>

namespace kerf
{
PenaltyConstraint::PenaltyConstraint(const Settings &settings, const Eigen::Matrix3Xd &positions,
                                     const Eigen::Vector3d &periodic)
  : settings(settings), positions(positions), periodic(periodic)
{
}

void PenaltyConstraint::set_particles(const std::vector<int> &indices)
{
  std::unordered_map<int, fem::Interpolation> kept;
  pending.clear();
  for (const int index : indices)
  {
    const auto known = interpolation.find(index);
    if (known == interpolation.end())
      pending.push_back(index);
    else
      kept.insert(*known);
  }
  interpolation = std::move(kept);
  n_constrained = static_cast<int>(indices.size());
  planned = false;
}

void PenaltyConstraint::plan(const dem::Particles &particles, fem::FemSide &fem)
{
  // The interpolation lives in the reference configuration: it is found once and stays valid wherever the particle moves.
  if (!pending.empty())
  {
    Eigen::Matrix3Xd points(3, pending.size());
    for (std::size_t k = 0; k < pending.size(); ++k)
      points.col(k) = positions.col(pending[k]);
    const std::vector<fem::Interpolation> found = fem.locate(points);
    for (std::size_t k = 0; k < pending.size(); ++k)
      if (found[k].cell >= 0)
        interpolation[pending[k]] = found[k];
    pending.clear();
  }

  std::map<int, int> window; // node -> column
  std::vector<int> nodes;
  links.clear();
  for (int i = 0; i < particles.n; ++i)
  {
    const auto found = interpolation.find(particles.index[i]);
    if (found == interpolation.end())
      continue;
    Link link;
    link.particle = i;
    link.reference = positions.col(particles.index[i]);
    link.n = found->second.n;
    link.N = found->second.N;
    for (int a = 0; a < link.n; ++a)
    {
      const auto entry = window.emplace(found->second.nodes[a], static_cast<int>(nodes.size()));
      if (entry.second)
        nodes.push_back(found->second.nodes[a]);
      link.window_node[a] = entry.first->second;
    }
    links.push_back(link);
  }
  fem.set_window(nodes);

  Eigen::Matrix3Xd node_mass;
  fem.read_window(fem::NodalField::mass, node_mass);
  for (Link &link : links)
  {
    double inverse_mass = 1. / particles.mass[link.particle];
    bool massless_node = false;
    for (int a = 0; a < link.n; ++a)
      if (link.N[a] > 0.)
      {
        const double mass = node_mass(0, link.window_node[a]);
        massless_node = massless_node || mass <= 0.;
        inverse_mass += mass > 0. ? link.N[a] * link.N[a] / mass : 0.;
      }
    // A node without mass cannot carry a reaction; its cell is switched off, so there is nothing to be tied to.
    const double scaled = settings.beta / (inverse_mass * settings.time_step * settings.time_step);
    link.stiffness = massless_node ? 0. : (settings.mass_scaled ? scaled : settings.stiffness);
  }
  window_force.resize(3, nodes.size());
  planned_order = particles.order;
  planned = true;
}

double PenaltyConstraint::apply(dem::Particles &particles, fem::FemSide &fem)
{
  if (n_constrained == 0)
    return 0.;
  // Windows are collective, so all ranks plan again when particles moved on any of them.
  int stale = !planned || planned_order != particles.order;
  MPI_Allreduce(MPI_IN_PLACE, &stale, 1, MPI_INT, MPI_MAX, settings.comm);
  if (stale)
    plan(particles, fem);

  fem.read_window(fem::NodalField::displacement, window_displacement);
  window_force.setZero();
  double energy = 0.;
  for (const Link &link : links)
  {
    Eigen::Vector3d chi = particles.position.col(link.particle) - link.reference;
    for (int a = 0; a < link.n; ++a)
      chi -= link.N[a] * window_displacement.col(link.window_node[a]);
    chi = dem::shortest_image(chi, periodic);
    const Eigen::Vector3d force = link.stiffness * chi;
    particles.force.col(link.particle) -= force;
    for (int a = 0; a < link.n; ++a)
      window_force.col(link.window_node[a]) += link.N[a] * force;
    energy += 0.5 * force.dot(chi);
  }
  fem.add_window_forces(window_force);
  return energy;
}
} // namespace kerf
