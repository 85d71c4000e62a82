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
  n_local = particles.n;
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
void PenaltyConstraint::pack(std::vector<Spring<dim>> &springs) const
{
  springs.clear();
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    Spring<dim> spring;
    spring.particle = link.particle;
    spring.stiffness = stiffness[k];
    std::copy_n(link.origin.begin(), dim, spring.origin.begin());
    for (int a = 0; a < 1 << dim; ++a)
    {
      spring.node[a] = link.node[a < link.n ? a : 0];
      spring.N[a] = a < link.n ? link.N[a] : 0.;
    }
    springs.push_back(spring);
  }
}

/// f_i = -k_i chi_i and its reaction.
template <int dim>
void PenaltyConstraint::pull(const std::vector<Spring<dim>> &springs, dem::Particles &particles)
{
  const bool periodic = !packing.periodic.isZero(0.);
  const double *x = particles.position.data(), *u = node_displacement.data();
  double *f = particles.force.data(), *reaction = node_force.data();
  for (const Spring<dim> &spring : springs)
  {
    std::array<double, dim> chi;
    for (int c = 0; c < dim; ++c)
    {
      chi[c] = x[3 * spring.particle + c] - spring.origin[c];
      for (int a = 0; a < 1 << dim; ++a)
        chi[c] -= spring.N[a] * u[3 * spring.node[a] + c];
    }
    if (periodic)
      for (int c = 0; c < dim; ++c)
        if (packing.periodic[c] > 0.)
          chi[c] -= packing.periodic[c] * std::round(chi[c] / packing.periodic[c]);
    for (int c = 0; c < dim; ++c)
    {
      const double force = spring.stiffness * chi[c];
      f[3 * spring.particle + c] -= force;
      for (int a = 0; a < 1 << dim; ++a)
        reaction[3 * spring.node[a] + c] += spring.N[a] * force;
      stored += 0.5 * force * chi[c];
    }
  }
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
  if (links.update(particles, fem))
    choose_springs(particles, fem);

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
