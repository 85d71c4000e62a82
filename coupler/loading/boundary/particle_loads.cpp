// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/boundary/particle_loads.h"

namespace kerf
{
ParticleLoads::ParticleLoads(const fem::Settings &body, const fem::Mesh &mesh, const dem::Packing &packing)
  : gravity(body.gravity), gravity_ramp(body.gravity_ramp), pushes(packing.size())
{
  const Eigen::Matrix3d stress = fem::initial_state(body).first_piola;
  for (const fem::BoundaryCondition &condition : body.boundary_conditions)
  {
    const fem::BoundaryKind kind = condition.kind;
    Load load;
    load.ramp = condition.ramp;
    load.held_before_start = kind == fem::BoundaryKind::in_situ || kind == fem::BoundaryKind::absorbing;
    if (kind == fem::BoundaryKind::traction)
      load.traction = condition.traction;
    else if (load.held_before_start && stress.norm() > 0.)
      load.stress = stress;
    else
      continue;
    loads.push_back(load);
    sides.emplace_back(mesh, fem::selected_faces(mesh, condition), packing, body.surface_spacing);
  }
  update_forces();
}

void ParticleLoads::update_forces()
{
  for (std::vector<Push> &list : pushes)
    list.clear();
  for (std::size_t k = 0; k < loads.size(); ++k)
    for (const TributaryArea &share : sides[k].areas())
      pushes[share.particle].push_back(
        {static_cast<int>(k), share.area * (loads[k].traction + loads[k].stress * share.normal)});
  planned_order = ~0ull;
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
      const double start = loads[push.load].held_before_start ? 1. : fem::smooth_start(time, loads[push.load].ramp);
      add(i, start * push.force);
    }
  if (gravity.norm() > 0.)
  {
    const Eigen::Vector3d acceleration = fem::smooth_start(time, gravity_ramp) * gravity;
    for (int i = 0; i < particles.n; ++i)
      add(i, particles.mass[i] * acceleration);
  }
}
} // namespace kerf
