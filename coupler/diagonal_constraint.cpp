// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/diagonal_constraint.h"

#include <Eigen/Geometry>

namespace kerf
{
using Eigen::Vector3d;

DiagonalConstraint::DiagonalConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), links(packing, WindowNodes::own, settings.comm), work(settings.time_step, settings.comm)
{
}

void DiagonalConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  links.set_particles(particles);
}

void DiagonalConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  if (links.n_particles() == 0)
    return;
  work.begin(phase, particles, fem);
  if (links.update(particles, fem) == LinkChange::renewed)
  {
    mass = links.tied_masses(particles, fem);
    fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  }
  fem.read_window(fem::NodalField::displacement, displacement);
  fem.read_window(fem::NodalField::velocity, velocity);
  fem.read_window(fem::NodalField::force, force);

  const double dt = settings.time_step;
  // In a step the hook sees v^{n-1/2} and the forces lead to v^{n+1/2}; after a setup half a step leads there.
  const double tau = phase == dem::Phase::step ? dt : 0.5 * dt;
  const Eigen::Matrix3Xd ahead = velocity + tau * inverse_node_mass.cwiseProduct(force);
  node_force.setZero(3, links.n_window());
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const int i = link.particle;
    Vector3d rate = particles.velocity.col(i) + tau / particles.mass[i] * particles.force.col(i);
    for (int a = 0; a < link.n; ++a)
      rate -= link.N[a] * ahead.col(link.node[a]);
    const Vector3d chi = links.displacement_gap(link, particles, displacement);
    const Vector3d pull = link.share * mass[k] / tau * (rate + settings.closing / dt * chi);
    const Vector3d couple = chi.cross(pull);
    particles.force.col(i) -= pull;
    particles.torque.col(i) += couple;
    work.add(particles, i, -pull, couple);
    OverlapLinks::spread(link, pull, node_force);
  }
  fem.add_window_forces(node_force);
  work.end(node_force, velocity);
}
} // namespace kerf
