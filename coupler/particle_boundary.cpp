// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/particle_boundary.h"

#include "coupler/region_distance.h"

#include <cmath>
#include <map>

namespace kerf
{
using Eigen::Vector3d;

ParticleBoundary::ParticleBoundary(const fem::Mesh &mesh, const fem::Material &rock,
                                   const std::vector<fem::BoundaryCondition> &conditions, const dem::Packing &packing)
  : conditions(conditions), impedance_p(rock.density * rock.speed_p()), impedance_s(rock.density * rock.speed_s()),
    touches(packing.size())
{
  const double mean_radius = 0.5 * packing.mean_diameter;
  for (std::size_t c = 0; c < conditions.size(); ++c)
  {
    if (conditions[c].kind == fem::BoundaryKind::free)
      continue;
    double face_area = 0., particle_area = 0.;
    std::vector<int> touching;
    for (const fem::BoundaryFace &face : mesh.boundary)
    {
      if (face.id != conditions[c].id)
        continue;
      const Vector3d a = mesh.nodes.col(face.nodes[0]), b = mesh.nodes.col(face.nodes[1]);
      const Vector3d tangent = (b - a).normalized();
      face_area += (b - a).norm();
      const double margin = packing.radii.maxCoeff() + 0.5 * mean_radius;
      const Vector3d lower = a.cwiseMin(b).array() - margin, upper = a.cwiseMax(b).array() + margin;
      for (int i = 0; i < packing.size(); ++i)
      {
        const Vector3d x = packing.positions.col(i);
        if ((x.array() < lower.array()).any() || (x.array() > upper.array()).any() ||
            distance_to_face(mesh, face, x) >= packing.radii[i] + 0.5 * mean_radius)
          continue;
        if (!touches[i].empty() && touches[i].back().condition == static_cast<int>(c))
          continue; // two faces of the same boundary
        touches[i].push_back({static_cast<int>(c), Vector3d(tangent[1], -tangent[0], 0.), 2. * packing.radii[i]});
        particle_area += 2. * packing.radii[i];
        touching.push_back(i);
      }
    }
    for (const int i : touching)
      touches[i].back().area *= face_area / particle_area; // the dashpots stand for the face exactly once
  }
  for (const auto &touch : touches)
    n_on_boundary += !touch.empty();
}

void ParticleBoundary::apply(dem::Particles &particles, double time, double dt)
{
  if (planned_order != particles.order)
  {
    local.clear();
    for (int i = 0; i < particles.n; ++i)
      if (!touches[particles.index[i]].empty())
        local.push_back(i);
    planned_order = particles.order;
  }
  for (const int i : local)
    for (const Touch &touch : touches[particles.index[i]])
    {
      const fem::BoundaryCondition &condition = conditions[touch.condition];
      auto force = particles.force.col(i);
      auto velocity = particles.velocity.col(i);
      switch (condition.kind)
      {
      case fem::BoundaryKind::fixed:
        force.setZero();
        velocity.setZero();
        particles.torque.col(i).setZero();
        particles.angular_velocity.col(i).setZero();
        break;
      case fem::BoundaryKind::velocity:
        // The velocity of the coming half step, so that the positions follow the prescribed motion.
        force.setZero();
        velocity = condition.velocity_at(time + 0.5 * dt);
        particles.torque.col(i).setZero();
        particles.angular_velocity.col(i).setZero();
        break;
      case fem::BoundaryKind::roller:
        force -= force.dot(touch.normal) * touch.normal;
        velocity -= velocity.dot(touch.normal) * touch.normal;
        break;
      case fem::BoundaryKind::absorbing:
      {
        const Vector3d normal_velocity = velocity.dot(touch.normal) * touch.normal;
        force -= touch.area * particles.weight[i] *
                 (impedance_p * normal_velocity + impedance_s * (Vector3d(velocity) - normal_velocity));
        break;
      }
      case fem::BoundaryKind::free:
        break;
      }
    }
}
} // namespace kerf
