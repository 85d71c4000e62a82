// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool.h"

#include "coupler/method/overlap/region_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;
namespace
{
constexpr double huge = 1e300; // no bound
}

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

Disc::Disc(const Case::Tool &settings)
  : radius(settings.radius), width(settings.width), path(settings.path, settings.smoothing_time), rolling(settings.rolling)
{
}

void Disc::move_to(double time)
{
  centre = path.position(time);
  velocity = path.velocity(time);
  // Rolling without slip along the lowest point: v_x + spin R = 0.
  spin = rolling ? -velocity[0] / radius : 0.;
  angle += spin * (time - time_of_angle);
  time_of_angle = time;
}

NearestSurface Disc::nearest(const Vector3d &point) const
{
  const Vector3d arm(point[0] - centre[0], point[1] - centre[1], 0.);
  const double distance = arm.norm();
  const Vector3d radial = distance > 0. ? Vector3d(arm / distance) : Vector3d::UnitY();
  if (width == 0.)
    return {distance - radius, radial, velocity + spin * radius * Vector3d(-radial[1], radial[0], 0.)};
  const Vector3d core = std::min(distance, radius - 0.5 * width) * radial; // nearest place of the flat disc inside
  const Vector3d away = point - centre - core;
  const double length = away.norm();
  const Vector3d normal = length > 0. ? Vector3d(away / length) : Vector3d::UnitZ();
  const Vector3d place = core + 0.5 * width * normal;
  return {length - 0.5 * width, normal, velocity + spin * Vector3d(-place[1], place[0], 0.)};
}

Box Disc::bounds(double reach) const
{
  const Vector3d half(radius + reach, radius + reach, width > 0. ? 0.5 * width + reach : huge);
  return {centre - half, centre + half};
}

Platen::Platen(double y, double speed, double ramp) : start(y), full_speed(speed), ramp(ramp), y(y) {}

void Platen::move_to(double time)
{
  // Half a cosine wave: s(t) = v (t - sin(pi t/T) T/pi)/2 while it lasts.
  if (time <= 0.)
    y = start, speed = 0.;
  else if (time < ramp)
  {
    const double phase = M_PI * time / ramp;
    speed = 0.5 * full_speed * (1. - std::cos(phase));
    y = start + 0.5 * full_speed * (time - std::sin(phase) * ramp / M_PI);
  }
  else
  {
    speed = full_speed;
    y = start + full_speed * (time - 0.5 * ramp);
  }
}

NearestSurface Platen::nearest(const Vector3d &point) const
{
  const double side = full_speed >= 0. ? 1. : -1.;
  return {side * (point[1] - y), side * Vector3d::UnitY(), speed * Vector3d::UnitY()};
}

Box Platen::bounds(double reach) const
{
  Box box{Vector3d::Constant(-huge), Vector3d::Constant(huge)};
  if (full_speed >= 0.)
    box.upper[1] = y + reach;
  else
    box.lower[1] = y - reach;
  return box;
}

double surface_stiffness(const Case::Tool &settings, int dim, double k_n, double spacing)
{
  return settings.stiffness_ratio * k_n / (dim == 2 ? spacing : spacing * spacing);
}

Tool::Tool(const Case::Tool &settings, int dim, double k_n, double spacing, double density, MPI_Comm comm)
  : settings(settings), law{settings.friction}, particle_stiffness(settings.stiffness_ratio * k_n),
    surface_stiffness(kerf::surface_stiffness(settings, dim, k_n, spacing)),
    surface_damping(2. * settings.damping * std::sqrt(density * spacing * surface_stiffness)), comm(comm)
{
  if (settings.kind == Case::ToolKind::disc)
  {
    bodies.push_back(std::make_unique<Disc>(settings));
    shares = {1.};
  }
  else if (settings.kind == Case::ToolKind::platens)
  {
    const double speed = 0.5 * settings.closing_speed;
    bodies.push_back(std::make_unique<Platen>(settings.lower, speed, settings.smoothing_time));
    bodies.push_back(std::make_unique<Platen>(settings.upper, -speed, settings.smoothing_time));
    shares = {-0.5, 0.5};
  }
  move_to(0.);
}

void Tool::move_to(double time)
{
  for (const auto &body : bodies)
    body->move_to(time);
}

Vector3d Tool::contact_force(const NearestSurface &surface, const Vector3d &rock_velocity, double stiffness, double damping,
                             double share)
{
  const Vector3d force = law.force(surface.gap, surface.normal, rock_velocity - surface.velocity, stiffness, damping);
  load.force += share * force;
  load.power += force.dot(surface.velocity);
  return force;
}

void Tool::push_particles(const RigidBody &body, dem::Particles &particles, double share)
{
  const Box touchable = body.bounds(0.);
  for (int i = 0; i < particles.n; ++i)
  {
    const double radius = particles.radius[i];
    const auto x = particles.position.col(i);
    if (x[1] > touchable.upper[1] + radius || x[1] < touchable.lower[1] - radius || x[0] > touchable.upper[0] + radius ||
        x[0] < touchable.lower[0] - radius || x[2] > touchable.upper[2] + radius || x[2] < touchable.lower[2] - radius)
      continue;
    NearestSurface surface = body.nearest(particles.position.col(i));
    surface.gap -= radius;
    if (surface.gap >= 0.)
      continue;
    const Vector3d arm = -radius * surface.normal;
    const Vector3d rock_velocity = particles.velocity.col(i) + particles.angular_velocity.col(i).cross(arm);
    const double stiffness = particles.weight[i] * particle_stiffness;
    const double damping = 2. * settings.damping * std::sqrt(stiffness * particles.mass[i]);
    const Vector3d force = contact_force(surface, rock_velocity, stiffness, damping, share);
    particles.force.col(i) += force;
    particles.torque.col(i) += arm.cross(force);
    touched_particles.push_back(i);
  }
}

void Tool::push_surface(const RigidBody &body, fem::FemSide &fem, double share)
{
  const Box box = body.bounds(0.);
  // A distance changes by no more than one moves: faces of which every point is clear need no points, and a box around a disc
  // has many of them.
  const auto near = [&](const Vector3d &centre, double radius) { return body.nearest(centre).gap < radius; };
  fem.surface_points(box.lower, box.upper, near, surface);
  surface_force.resize(3, surface.position.cols());
  for (int q = 0; q < surface.position.cols(); ++q)
    surface_force.col(q) = contact_force(body.nearest(surface.position.col(q)), surface.velocity.col(q),
                                         surface.area[q] * surface_stiffness, surface.area[q] * surface_damping, share);
  fem.add_surface_forces(surface_force, fem::SurfaceLoad::tool);
}

void Tool::apply(dem::Particles &particles, fem::FemSide &fem)
{
  load = Load();
  touched_particles.clear();
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    push_particles(*bodies[b], particles, shares[b]);
    if (fem.n_active_cells() > 0)
      push_surface(*bodies[b], fem, shares[b]);
  }
}

std::array<double, 2> Tool::platens() const
{
  if (settings.kind != Case::ToolKind::platens)
    return {{0., 0.}};
  return {{static_cast<const Platen &>(*bodies[0]).y, static_cast<const Platen &>(*bodies[1]).y}};
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
