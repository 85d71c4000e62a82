// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/tool.h"

#include "coupler/region_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

ToolPath::ToolPath(const std::vector<std::pair<double, Vector3d>> &way_points, double smoothing_time)
  : points(way_points), window(smoothing_time)
{
}

Vector3d ToolPath::polygon(double time) const
{
  if (time <= points.front().first)
    return points.front().second;
  for (std::size_t k = 1; k < points.size(); ++k)
    if (time <= points[k].first)
    {
      const double s = (time - points[k - 1].first) / (points[k].first - points[k - 1].first);
      return (1. - s) * points[k - 1].second + s * points[k].second;
    }
  return points.back().second;
}

Vector3d ToolPath::integral(double time) const
{
  Vector3d sum = Vector3d::Zero();
  double from = points.front().first;
  if (time <= from)
    return (time - from) * points.front().second;
  for (std::size_t k = 1; k < points.size() && from < time; ++k)
  {
    const double to = std::min(time, points[k].first);
    sum += 0.5 * (to - from) * (polygon(from) + polygon(to)); // exact: linear in between
    from = to;
  }
  if (time > points.back().first)
    sum += (time - points.back().first) * points.back().second;
  return sum;
}

Vector3d ToolPath::position(double time) const
{
  if (window <= 0.)
    return polygon(time);
  return (integral(time + 0.5 * window) - integral(time - 0.5 * window)) / window;
}

Vector3d ToolPath::velocity(double time) const
{
  if (window > 0.)
    return (polygon(time + 0.5 * window) - polygon(time - 0.5 * window)) / window;
  for (std::size_t k = 1; k < points.size(); ++k)
    if (time >= points[k - 1].first && time < points[k].first)
      return (points[k].second - points[k - 1].second) / (points[k].first - points[k - 1].first);
  return Vector3d::Zero();
}

Vector3d ToolContactLaw::force(double gap, const Vector3d &normal, const Vector3d &relative, double stiffness,
                               double damping) const
{
  if (gap >= 0.)
    return Vector3d::Zero();
  const double normal_velocity = relative.dot(normal);
  const double normal_force = std::max(0., -stiffness * gap - damping * normal_velocity);
  const Vector3d sliding = relative - normal_velocity * normal;
  const double speed = sliding.norm();
  Vector3d result = normal_force * normal;
  if (speed > 0.)
    result -= std::min(friction * normal_force, damping * speed) / speed * sliding;
  return result;
}

Tool::Tool(const Case::Tool &settings, double k_n, double diameter, double density, MPI_Comm comm)
  : settings(settings), path(settings.path, settings.smoothing_time), law{settings.friction},
    particle_stiffness(settings.stiffness_ratio * k_n), surface_stiffness(particle_stiffness / diameter),
    surface_damping(2. * settings.damping * std::sqrt(density * diameter * surface_stiffness)), comm(comm)
{
  if (settings.present)
    move_to(0.);
}

void Tool::move_to(double time)
{
  position = path.position(time);
  velocity = path.velocity(time);
  // Rolling without slip along the lowest point: v_x + spin R = 0.
  spin = settings.rolling ? -velocity[0] / settings.radius : 0.;
  rotation_angle += spin * (time - rotation_time);
  rotation_time = time;
}

Vector3d Tool::contact_force(const Vector3d &point, const Vector3d &point_velocity, const Vector3d &angular_velocity,
                             double point_radius, double stiffness, double damping)
{
  const Vector3d arm = point - position;
  const double distance = arm.norm();
  const double gap = distance - settings.radius - point_radius;
  if (gap >= 0. || distance <= 0.)
    return Vector3d::Zero();
  const Vector3d normal = arm / distance;
  const Vector3d at_contact = settings.radius * normal;
  const Vector3d tool_velocity = velocity + Vector3d(-spin * at_contact[1], spin * at_contact[0], 0.);
  const Vector3d rock_velocity = point_velocity - point_radius * angular_velocity.cross(normal);
  const Vector3d force = law.force(gap, normal, rock_velocity - tool_velocity, stiffness, damping);
  load.force += force;
  load.power += force.dot(tool_velocity);
  return force;
}

void Tool::apply(dem::Particles &particles, fem::FemSide &fem)
{
  load = Load();
  if (!settings.present)
    return;
  for (int i = 0; i < particles.n; ++i)
  {
    const double reach = settings.radius + particles.radius[i];
    if ((particles.position.col(i) - position).squaredNorm() >= reach * reach)
      continue;
    const double stiffness = particles.weight[i] * particle_stiffness;
    const double damping = 2. * settings.damping * std::sqrt(stiffness * particles.mass[i]);
    const Vector3d force = contact_force(particles.position.col(i), particles.velocity.col(i),
                                         particles.angular_velocity.col(i), particles.radius[i], stiffness, damping);
    const Vector3d arm = particles.radius[i] * (position - particles.position.col(i)).normalized();
    particles.force.col(i) += force;
    particles.torque.col(i) += arm.cross(force);
  }

  if (fem.n_active_cells() == 0)
    return;
  const Vector3d reach = Vector3d(settings.radius, settings.radius, 1.);
  fem.surface_points(position - reach, position + reach, surface);
  surface_force.resize(3, surface.position.cols());
  for (int q = 0; q < surface.position.cols(); ++q)
    surface_force.col(q) = contact_force(surface.position.col(q), surface.velocity.col(q), Vector3d::Zero(), 0.,
                                         surface.area[q] * surface_stiffness, surface.area[q] * surface_damping);
  fem.add_surface_forces(surface_force);
}

Tool::Load Tool::total(const Load &local) const
{
  double values[4] = {local.force[0], local.force[1], local.force[2], local.power};
  MPI_Allreduce(MPI_IN_PLACE, values, 4, MPI_DOUBLE, MPI_SUM, comm);
  Load sum;
  sum.force = Vector3d(values[0], values[1], values[2]);
  sum.power = values[3];
  return sum;
}

double Tool::clearance(const Case::Tool &tool, const fem::FemSide &fem)
{
  const Vector3d centre = ToolPath(tool.path, tool.smoothing_time).position(0.);
  double distance = 1e300;
  for (const fem::BoundaryFace &face : fem.mesh().boundary)
    distance = std::min(distance, distance_to_face(fem.mesh(), face, centre));
  Eigen::Matrix3Xd point(3, 1);
  point.col(0) = centre;
  const bool inside = fem.locate(point)[0].cell >= 0;
  return inside ? -distance - tool.radius : distance - tool.radius;
}
} // namespace kerf
