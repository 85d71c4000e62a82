// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/particle_boundary.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
double distance_to_segment(const Vector3d &a, const Vector3d &b, const Vector3d &point)
{
  const Vector3d edge = b - a;
  return (point - a - std::clamp((point - a).dot(edge) / edge.squaredNorm(), 0., 1.) * edge).norm();
}

double distance_to_triangle(const Vector3d &a, const Vector3d &b, const Vector3d &c, const Vector3d &point)
{
  const Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Vector3d &from, const Vector3d &to)
  { return normal.dot((to - from).cross(point - from)) >= 0.; };
  if (inside(a, b) && inside(b, c) && inside(c, a))
    return std::abs(normal.normalized().dot(point - a));
  return std::min({distance_to_segment(a, b, point), distance_to_segment(b, c, point), distance_to_segment(c, a, point)});
}

/// A face of the boundary with its geometry; 3D faces are two triangles.
struct Face
{
  Face(const fem::Mesh &mesh, const fem::BoundaryFace &face) : dim(mesh.dim)
  {
    const int n = dim == 2 ? 2 : 4;
    for (int k = 0; k < n; ++k)
      corner.col(k) = mesh.nodes.col(face.nodes[k]);
    lower = corner.leftCols(n).rowwise().minCoeff();
    upper = corner.leftCols(n).rowwise().maxCoeff();
    const Vector3d along = corner.col(1) - corner.col(0);
    // Lexicographic corners: 0 and 3 are opposite.
    const Vector3d area_vector = dim == 2
                                   ? Vector3d(along[1], -along[0], 0.)
                                   : Vector3d(0.5 * (corner.col(3) - corner.col(0)).cross(corner.col(2) - corner.col(1)));
    area = area_vector.norm();
    normal = area_vector / area;
  }
  double distance(const Vector3d &point) const
  {
    if (dim == 2)
      return distance_to_segment(corner.col(0), corner.col(1), point);
    return std::min(distance_to_triangle(corner.col(0), corner.col(1), corner.col(3), point),
                    distance_to_triangle(corner.col(0), corner.col(3), corner.col(2), point));
  }

  int dim;
  Eigen::Matrix<double, 3, 4> corner;
  Vector3d lower, upper, normal;
  double area;
};
} // namespace

ParticleBoundary::ParticleBoundary(const fem::Mesh &mesh, const fem::Material &rock,
                                   const std::vector<fem::BoundaryCondition> &conditions, const dem::Packing &packing)
  : conditions(conditions), Z_p(rock.density * rock.speed_p()), Z_s(rock.density * rock.speed_s()), roles(packing.size())
{
  const double mean_radius = 0.5 * packing.mean_diameter;
  const double margin = packing.size() > 0 ? packing.radii.maxCoeff() + 0.5 * mean_radius : 0.;
  const auto section = [&](int i)
  { return mesh.dim == 2 ? 2. * packing.radii[i] : M_PI * packing.radii[i] * packing.radii[i]; };
  for (const fem::BoundaryKind kind :
       {fem::BoundaryKind::fixed, fem::BoundaryKind::velocity, fem::BoundaryKind::roller, fem::BoundaryKind::absorbing})
    for (std::size_t c = 0; c < conditions.size(); ++c)
    {
      if (conditions[c].kind != kind)
        continue;
      double face_area = 0., particle_area = 0.;
      std::vector<char> touching(packing.size(), 0);
      for (const fem::BoundaryFace &boundary_face : mesh.boundary)
      {
        if (boundary_face.id != conditions[c].id)
          continue;
        const Face face(mesh, boundary_face);
        face_area += face.area;
        for (int i = 0; i < packing.size(); ++i)
        {
          const Vector3d x = packing.positions.col(i);
          if (touching[i] || (x.array() < face.lower.array() - margin).any() ||
              (x.array() > face.upper.array() + margin).any() || face.distance(x) >= packing.radii[i] + 0.5 * mean_radius)
            continue;
          touching[i] = 1;
          Role &role = roles[i];
          if (kind == fem::BoundaryKind::absorbing)
          {
            role.dashpots.push_back({face.normal, section(i)});
            particle_area += section(i);
          }
          else if (role.held)
            continue;
          else if (kind == fem::BoundaryKind::roller)
          {
            int axis = 0;
            face.normal.cwiseAbs().maxCoeff(&axis); // rollers are parallel to the axes
            role.blocked[axis] = true;
          }
          else
          {
            role.held = true;
            role.driver = kind == fem::BoundaryKind::velocity ? static_cast<int>(c) : -1;
          }
        }
      }
      if (kind == fem::BoundaryKind::absorbing)
        for (int i = 0; i < packing.size(); ++i)
          if (touching[i])
            roles[i].dashpots.back().area *= face_area / particle_area; // the dashpots stand for the face exactly once
    }
  for (Role &role : roles)
  {
    if (role.held)
      role.dashpots.clear(); // nothing to absorb
    n_on_boundary += !role.free();
  }
}

Vector3d dashpot_force(const ParticleBoundary::Dashpot &dashpot, double weight, double impedance_p, double impedance_s,
                       const Vector3d &velocity)
{
  const Vector3d normal_velocity = velocity.dot(dashpot.normal) * dashpot.normal;
  return -dashpot.area * weight * (impedance_p * normal_velocity + impedance_s * (velocity - normal_velocity));
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

void ParticleBoundary::damp(dem::Particles &particles, OuterWork &absorbing)
{
  for (const int i : on_this_rank(particles))
    for (const Dashpot &dashpot : roles[particles.index[i]].dashpots)
    {
      const Vector3d damping = dashpot_force(dashpot, particles.weight[i], Z_p, Z_s, particles.velocity.col(i));
      particles.force.col(i) += damping;
      absorbing.add(particles, i, damping, Vector3d::Zero());
    }
}

void ParticleBoundary::hold(dem::Particles &particles, double time, double dt, OuterWork &work)
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
