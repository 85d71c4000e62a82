// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/penalty_constraint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
double penalty_stiffness(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  if (mu <= 0.)
    return 0.;
  return share * (settings.mass_scaled ? settings.beta * mu / (settings.time_step * settings.time_step) : settings.stiffness);
}

double penalty_viscosity(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  return 2. * settings.damping * std::sqrt(penalty_stiffness(settings, share, mu) * share * mu);
}

PenaltyConstraint::PenaltyConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), links(packing, WindowNodes::own, settings.comm),
    damping_work(settings.time_step, settings.comm)
{
}

void PenaltyConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  links.set_particles(particles);
}

void PenaltyConstraint::choose_springs(const dem::Particles &particles, fem::FemSide &fem)
{
  const std::vector<double> masses = links.tied_masses(particles, fem);
  stiffness.clear();
  viscosity.clear();
  for (std::size_t k = 0; k < masses.size(); ++k)
  {
    const double share = links.links()[k].share;
    stiffness.push_back(penalty_stiffness(settings, share, masses[k]));
    viscosity.push_back(penalty_viscosity(settings, share, masses[k]));
  }
  if (packing.dim == 2)
    pack<2>(springs_2d);
  else
    pack<3>(springs_3d);
}

template <int dim>
void PenaltyConstraint::pack(Packed<dim> &packed) const
{
  const std::vector<OverlapLink> &list = links.links();
  packed.cells.clear();
  std::vector<std::vector<int>> cells_at(links.n_window()); // by the first node
  std::vector<int> cell_of(list.size()), count;
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    Cell<dim> cell;
    for (int a = 0; a < 1 << dim; ++a)
      cell.node[a] = list[k].node[a < list[k].n ? a : 0];
    std::vector<int> &near = cells_at[cell.node[0]];
    auto found = std::find_if(near.begin(), near.end(), [&](int c) { return packed.cells[c].node == cell.node; });
    if (found == near.end())
    {
      found = near.insert(near.end(), static_cast<int>(packed.cells.size()));
      packed.cells.push_back(cell);
      count.push_back(0);
    }
    cell_of[k] = *found;
    ++count[*found];
  }

  int n = 0;
  std::vector<int> next;
  for (std::size_t c = 0; c < count.size(); ++c)
  {
    next.push_back(n_lanes * n);
    n += (count[c] + n_lanes - 1) / n_lanes;
    packed.cells[c].end = n;
  }
  packed.springs.assign(n, Springs<dim>());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    const int place = next[cell_of[k]]++, lane = place % n_lanes;
    Springs<dim> &springs = packed.springs[place / n_lanes];
    for (int l = lane; l < n_lanes; ++l) // what is left over finds a particle, too
      springs.link[l] = static_cast<int>(k);
    springs.stiffness[lane] = stiffness[k];
    for (int c = 0; c < dim; ++c)
      springs.origin[c][lane] = list[k].origin[c];
    for (int a = 0; a < list[k].n; ++a)
      springs.N[a][lane] = list[k].N[a];
  }
  renumber(packed);
}

template <int dim>
void PenaltyConstraint::renumber(Packed<dim> &packed) const
{
  for (Springs<dim> &springs : packed.springs)
    for (int l = 0; l < n_lanes; ++l)
      springs.particle[l] = links.links()[springs.link[l]].particle;
}

/// f_i = -k_i chi_i and its reaction.
template <int dim, bool periodic>
void PenaltyConstraint::pull(const Packed<dim> &packed, dem::Particles &particles)
{
  constexpr int corners = 1 << dim;
  const double *x = particles.position.data();
  double *f = particles.force.data();
  const auto sum = [](const Lanes &v) { return (v[0] + v[1]) + (v[2] + v[3]); };
  Lanes energy = {};
  const Springs<dim> *springs = packed.springs.data();
  for (const Cell<dim> &cell : packed.cells)
  {
    double u[dim][corners];
    Lanes reaction[dim][corners] = {};
    for (int c = 0; c < dim; ++c)
      for (int a = 0; a < corners; ++a)
        u[c][a] = node_displacement(c, cell.node[a]);
    for (const Springs<dim> *const end = packed.springs.data() + cell.end; springs < end; ++springs)
    {
      const int *p = springs->particle;
      for (int c = 0; c < dim; ++c)
      {
        Lanes chi = Lanes{x[3 * p[0] + c], x[3 * p[1] + c], x[3 * p[2] + c], x[3 * p[3] + c]} - springs->origin[c];
        for (int a = 0; a < corners; ++a)
          chi -= springs->N[a] * u[c][a];
        if (periodic && packing.periodic[c] > 0.)
          for (int l = 0; l < n_lanes; ++l)
            chi[l] -= packing.periodic[c] * std::round(chi[l] / packing.periodic[c]);
        const Lanes force = springs->stiffness * chi;
        for (int l = 0; l < n_lanes; ++l)
          f[3 * p[l] + c] -= force[l];
        for (int a = 0; a < corners; ++a)
          reaction[c][a] += springs->N[a] * force;
        energy += 0.5 * force * chi;
      }
    }
    for (int c = 0; c < dim; ++c)
      for (int a = 0; a < corners; ++a)
        node_force(c, cell.node[a]) += sum(reaction[c][a]);
  }
  stored = sum(energy);
}

Eigen::VectorXd PenaltyConstraint::springs() const
{
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n_local);
  for (std::size_t k = 0; k < links.links().size(); ++k)
    result[links.links()[k].particle] = stiffness[k];
  return result;
}

void PenaltyConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (links.n_particles() == 0)
    return;
  if (settings.damping > 0.)
    damping_work.begin(phase, particles, fem);
  n_local = particles.n;
  if (const LinkChange change = links.update(particles, fem); change == LinkChange::renewed)
    choose_springs(particles, fem);
  else if (change == LinkChange::renumbered)
    packing.dim == 2 ? renumber(springs_2d) : renumber(springs_3d);

  fem.read_window(fem::NodalField::displacement, node_displacement);
  node_force.setZero(3, links.n_window());
  if (packing.dim == 2)
    pull<2>(springs_2d, particles);
  else
    pull<3>(springs_3d, particles);
  fem.add_window_forces(node_force);
  if (settings.damping > 0.)
    add_damping(particles, fem);
}

/// Damping looks at the velocities of the half step before.
void PenaltyConstraint::add_damping(dem::Particles &particles, fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::velocity, node_velocity);
  node_force.setZero();
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const Eigen::Vector3d force = viscosity[k] * OverlapLinks::gap(link, particles.velocity, node_velocity);
    const Eigen::Vector3d couple = links.displacement_gap(link, particles, node_displacement).cross(force);
    particles.force.col(link.particle) -= force;
    particles.torque.col(link.particle) += couple;
    damping_work.add(particles, link.particle, -force, couple);
    OverlapLinks::spread(link, force, node_force);
  }
  fem.add_window_forces(node_force);
  damping_work.end(node_force, node_velocity);
}
} // namespace kerf
