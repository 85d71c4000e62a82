// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/penalty_constraint.h"

#include <Eigen/Geometry>
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
  : settings(settings), links(packing, WindowNodes::own, settings.comm), damping_work(settings.time_step, settings.comm)
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
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const Eigen::Vector3d chi = links.displacement_gap(link, particles, node_displacement);
    const Eigen::Vector3d force = stiffness[k] * chi;
    particles.force.col(link.particle) -= force;
    OverlapLinks::spread(link, force, node_force);
    stored += 0.5 * force.dot(chi);
  }
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
