// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/boundary/particle_boundary.h"

#include <algorithm>

namespace kerf
{
using Eigen::Vector3d;

ParticleBoundary::ParticleBoundary(const fem::Mesh &mesh, const fem::Material &rock,
                                   const std::vector<fem::BoundaryCondition> &conditions, const dem::Packing &packing,
                                   const double spacing)
  : conditions(conditions), Z_p(rock.density * rock.speed_p()), Z_s(rock.density * rock.speed_s()), roles(packing.size())
{
  for (const fem::BoundaryKind kind : {fem::BoundaryKind::fixed, fem::BoundaryKind::velocity, fem::BoundaryKind::roller})
    for (std::size_t c = 0; c < conditions.size(); ++c)
    {
      if (conditions[c].kind != kind)
        continue;
      for (const ParticleAtFace &found : particles_at_faces(mesh, fem::selected_faces(mesh, conditions[c]), packing))
      {
        Role &role = roles[found.particle];
        if (role.held)
          continue;
        else if (kind == fem::BoundaryKind::roller)
        {
          int axis = 0;
          found.normal.cwiseAbs().maxCoeff(&axis); // rollers are parallel to the axes
          role.blocked[axis] = true;
        }
        else
        {
          role.held = true;
          role.driver = kind == fem::BoundaryKind::velocity ? static_cast<int>(c) : -1;
        }
      }
    }
  for (const fem::BoundaryCondition &condition : conditions)
    if (condition.kind == fem::BoundaryKind::absorbing)
      absorbing_sides.emplace_back(mesh, fem::selected_faces(mesh, condition), packing, spacing);
  update_dashpots();
  n_on_boundary = static_cast<int>(std::count_if(roles.begin(), roles.end(), [](const Role &role) { return !role.free(); }));
}

void ParticleBoundary::update_dashpots()
{
  for (Role &role : roles)
    role.dashpots.clear();
  for (const TributaryAreas &side : absorbing_sides)
    for (const TributaryArea &share : side.areas())
      if (!roles[share.particle].held) // else there is nothing to absorb
        roles[share.particle].dashpots.push_back({share.normal, share.area});
  planned_order = ~0ull;
}

Vector3d dashpot_force(const ParticleBoundary::Dashpot &dashpot, double impedance_p, double impedance_s,
                       const Vector3d &velocity)
{
  const Vector3d normal_velocity = velocity.dot(dashpot.normal) * dashpot.normal;
  return -dashpot.area * (impedance_p * normal_velocity + impedance_s * (velocity - normal_velocity));
}

const std::vector<int> &ParticleBoundary::on_this_rank(const dem::Particles &particles)
{
  if (planned_order != particles.order)
  {
    local.clear();
    for (int i = 0; i < particles.n; ++i)
      if (!roles[particles.index[i]].free())
        local.push_back(i);
    planned_order = particles.order;
  }
  return local;
}

void ParticleBoundary::damp(dem::Particles &particles, ParticleWork &absorbing)
{
  for (const int i : on_this_rank(particles))
    for (const Dashpot &dashpot : roles[particles.index[i]].dashpots)
    {
      const Vector3d damping = dashpot_force(dashpot, Z_p, Z_s, particles.velocity.col(i));
      particles.force.col(i) += damping;
      absorbing.add(particles, i, damping, Vector3d::Zero());
    }
}

void ParticleBoundary::hold(dem::Particles &particles, double time, double dt, ParticleWork &work)
{
  for (const int i : on_this_rank(particles))
  {
    const Role &role = roles[particles.index[i]];
    auto force = particles.force.col(i);
    auto velocity = particles.velocity.col(i);
    if (role.held)
    {
      // The reaction balances all other forces. The velocity is that of the coming half step, so that the positions follow the
      // prescribed motion; the kinetic energy goes with it.
      work.add(particles, i, -force, -particles.torque.col(i));
      const double before = velocity.squaredNorm();
      force.setZero();
      particles.torque.col(i).setZero();
      particles.angular_velocity.col(i).setZero();
      velocity = role.driver < 0 ? Vector3d::Zero() : conditions[role.driver].velocity_at(time + 0.5 * dt);
      work.add_energy(0.5 * particles.mass[i] * (velocity.squaredNorm() - before));
    }
    for (int axis = 0; axis < 3; ++axis)
      if (role.blocked[axis])
        force[axis] = velocity[axis] = 0.; // a roller does no work
  }
}

std::vector<TiedParticle> ParticleBoundary::movable(const std::vector<TiedParticle> &particles) const
{
  std::vector<TiedParticle> result;
  for (TiedParticle particle : particles)
    if (const Role &role = roles[particle.index]; !role.held)
    {
      particle.blocked = role.blocked;
      result.push_back(particle);
    }
  return result;
}
} // namespace kerf
