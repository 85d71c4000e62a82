// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/boundary/particle_loads.h"

#include "coupler/loading/boundary/tributary_areas.h"

namespace kerf
{
ParticleLoads::ParticleLoads(const fem::Settings &body, const fem::Mesh &mesh, const dem::Packing &packing)
  : conditions(body.boundary_conditions), gravity(body.gravity), gravity_ramp(body.gravity_ramp), pushes(packing.size())
{
  const Eigen::Matrix3d stress = fem::initial_state(body).first_piola;
  for (std::size_t c = 0; c < conditions.size(); ++c)
  {
    const fem::BoundaryKind kind = conditions[c].kind;
    const bool holds = (kind == fem::BoundaryKind::in_situ || kind == fem::BoundaryKind::absorbing) && stress.norm() > 0.;
    if (kind != fem::BoundaryKind::traction && !holds)
      continue;
    for (const TributaryArea &share : tributary_areas(mesh, fem::selected_faces(mesh, conditions[c]), packing))
    {
      const Eigen::Vector3d traction = holds ? Eigen::Vector3d(stress * share.normal) : conditions[c].traction;
      pushes[share.particle].push_back({static_cast<int>(c), holds, share.area * traction});
    }
  }
}

void ParticleLoads::apply(dem::Particles &particles, double time, ParticleWork &work)
{
  if (planned_order != particles.order)
  {
    local.clear();
    for (int i = 0; i < particles.n; ++i)
      if (!pushes[particles.index[i]].empty())
        local.push_back(i);
    planned_order = particles.order;
  }
  const auto add = [&](int i, const Eigen::Vector3d &force)
  {
    particles.force.col(i) += force;
    work.add(particles, i, force, Eigen::Vector3d::Zero());
  };
  for (const int i : local)
    for (const Push &push : pushes[particles.index[i]])
    {
      const double start = push.held_before_start ? 1. : fem::smooth_start(time, conditions[push.condition].ramp);
      add(i, particles.weight[i] * start * push.force);
    }
  if (gravity.norm() > 0.)
  {
    const Eigen::Vector3d acceleration = fem::smooth_start(time, gravity_ramp) * gravity;
    for (int i = 0; i < particles.n; ++i)
      add(i, particles.mass[i] * acceleration);
  }
}
} // namespace kerf
