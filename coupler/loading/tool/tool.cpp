// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool.h"

#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/surface_resolution.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

namespace kerf
{
using Eigen::Vector3d;
double surface_stiffness(const ToolSettings &settings, int dim, double k_n, double mean_diameter)
{
  const double spacing = surface_resolution::particle_spacing * mean_diameter;
  return settings.stiffness_ratio * k_n / (dim == 2 ? spacing : spacing * spacing);
}

double surface_damping(const ToolSettings &settings, double stiffness, double density, double mean_diameter)
{
  return 2. * settings.damping * std::sqrt(density * surface_resolution::particle_spacing * mean_diameter * stiffness);
}

Tool::Tool(const ToolSettings &settings, int dim, double k_n, double mean_diameter, double density, MPI_Comm comm)
  : settings(settings), law{settings.friction}, particle_stiffness(settings.stiffness_ratio * k_n), density(density),
    surface_stiffness(kerf::surface_stiffness(settings, dim, k_n, mean_diameter)),
    surface_damping(kerf::surface_damping(settings, surface_stiffness, density, mean_diameter)), comm(comm),
    mean_diameter(mean_diameter)
{
  if (settings.kind == ToolKind::disc)
  {
    bodies.push_back(std::make_unique<Disc>(settings));
    shares = {1.};
  }
  else if (settings.kind == ToolKind::platens)
  {
    const double speed = 0.5 * settings.closing_speed;
    bodies.push_back(std::make_unique<Platen>(settings.lower, 1., speed, settings.smoothing_time));
    bodies.push_back(std::make_unique<Platen>(settings.upper, -1., -speed, settings.smoothing_time));
    shares = {-0.5, 0.5};
  }
  move_to(0.);
}

void Tool::set_time_step(double dt, double layer)
{
  if (settings.stiffness_ratio > 0.)
    return;
  // A spring beta m/dt^2 with a dashpot 2 xi sqrt(k m) adds beta + 4 xi sqrt(beta) to omega^2 dt^2.
  const double root = std::sqrt(4. * settings.damping * settings.damping + contact_share_of_step) - 2. * settings.damping;
  mass_stiffness = root * root / (dt * dt);
  surface_stiffness = mass_stiffness * density * layer;
  surface_damping = 2. * settings.damping * density * layer * std::sqrt(mass_stiffness);
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

double Tool::stiffness_against(const dem::Particles &particles, int i) const
{
  const double given = contact_weights.empty() ? -1. : contact_weights[particles.index[i]];
  const double weight = particles.weight[i], contact_weight = given < 0. ? weight : given;
  // A stiffness that follows the mass has no more than its share of the stable step.
  return mass_stiffness > 0. ? mass_stiffness * particles.mass[i] * std::min(1., contact_weight / weight)
                             : contact_weight * particle_stiffness;
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
    const double stiffness = stiffness_against(particles, i);
    const double damping = 2. * settings.damping * std::sqrt(stiffness * particles.mass[i]);
    const Vector3d force = contact_force(surface, rock_velocity, stiffness, damping, share);
    particles.force.col(i) += force;
    particles.torque.col(i) += arm.cross(force);
    touched_particles.push_back(i);
    contact_stiffness.push_back(stiffness);
  }
}

void Tool::push_surface(const RigidBody &body, fem::SurfaceContact &rock_surface, double share)
{
  const Box box = body.bounds(0.);
  // The gap changes by no more than the point moves. So it tells which faces are clear of the body altogether, and their points
  // need not be made: the box around a disc holds many such faces.
  const auto near = [&](const Vector3d &centre, double radius) { return body.nearest(centre).gap < radius; };
  rock_surface.surface_points(box.lower, box.upper, near, points);
  point_force.resize(3, points.position.cols());
  for (int q = 0; q < points.position.cols(); ++q)
    point_force.col(q) = contact_force(body.nearest(points.position.col(q)), points.velocity.col(q),
                                       points.area[q] * surface_stiffness, points.area[q] * surface_damping, share);
  rock_surface.add_surface_forces(point_force, fem::SurfaceLoad::tool);
}

void Tool::hold(const dem::Packing &packing)
{
  if (!settings.pulls())
    return;
  const double reach = packing.gap_tolerance * packing.radii.mean();
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    start_gaps[b].assign(packing.size(), std::numeric_limits<double>::infinity());
    for (int i = 0; i < packing.size(); ++i)
      if (const double gap = bodies[b]->nearest(packing.positions.col(i)).gap - packing.radii[i]; gap < reach)
        start_gaps[b][i] = gap;
  }
}

/// Spring and dashpot along the normal, in tension and compression. The rock slides along the platen freely, so that the
/// specimen contracts laterally. Theory (9.22).
Vector3d Tool::holding_force(const NearestSurface &surface, const Vector3d &rock_velocity, double stiffness, double damping,
                             double share)
{
  const double approach = (rock_velocity - surface.velocity).dot(surface.normal);
  const Vector3d force = (-stiffness * surface.gap - damping * approach) * surface.normal;
  load.force += share * force;
  load.power += force.dot(surface.velocity);
  return force;
}

void Tool::hold_particles(const RigidBody &body, const std::vector<double> &start_gap, dem::Particles &particles, double share)
{
  for (int i = 0; i < particles.n; ++i)
  {
    if (std::isinf(start_gap[particles.index[i]]))
      continue;
    NearestSurface surface = body.nearest(particles.position.col(i));
    surface.gap -= particles.radius[i] + start_gap[particles.index[i]];
    const double stiffness = stiffness_against(particles, i);
    const double damping = 2. * settings.damping * std::sqrt(stiffness * particles.mass[i]);
    particles.force.col(i) += holding_force(surface, particles.velocity.col(i), stiffness, damping, share);
    touched_particles.push_back(i);
    contact_stiffness.push_back(stiffness);
  }
}

void Tool::hold_surface(const RigidBody &body, fem::SurfaceContact &rock_surface, double share)
{
  // The surface follows the platen within far less than a diameter. Other faces of the specimen are not parallel to it.
  const Box box = body.bounds(mean_diameter);
  const auto near = [&](const Vector3d &centre, double radius) { return body.nearest(centre).gap < radius + mean_diameter; };
  rock_surface.surface_points(box.lower, box.upper, near, points);
  point_force.setZero(3, points.position.cols());
  for (int q = 0; q < points.position.cols(); ++q)
    if (const NearestSurface surface = body.nearest(points.position.col(q)); points.normal.col(q).dot(surface.normal) < -0.9)
      point_force.col(q) = holding_force(surface, points.velocity.col(q), points.area[q] * surface_stiffness,
                                         points.area[q] * surface_damping, share);
  rock_surface.add_surface_forces(point_force, fem::SurfaceLoad::tool);
}

void Tool::apply(dem::Particles &particles, fem::SurfaceContact *rock_surface)
{
  load = Load();
  touched_particles.clear();
  contact_stiffness.clear();
  for (std::size_t b = 0; b < bodies.size(); ++b)
  {
    if (settings.pulls())
    {
      hold_particles(*bodies[b], start_gaps[b], particles, shares[b]);
      if (rock_surface)
        hold_surface(*bodies[b], *rock_surface, shares[b]);
      continue;
    }
    push_particles(*bodies[b], particles, shares[b]);
    if (rock_surface)
      push_surface(*bodies[b], *rock_surface, shares[b]);
  }
}

std::vector<NearCell> Tool::near_cells(const fem::SurfaceContact &rock_surface, double reach, double duration) const
{
  std::vector<NearCell> cells;
  for (const auto &body : bodies)
  {
    const double distance = reach + duration * body->speed();
    const Box box = body->bounds(distance);
    const auto near = [&](const Vector3d &centre, double radius) { return body->nearest(centre).gap < radius + distance; };
    fem::SurfacePoints found;
    rock_surface.surface_points(box.lower, box.upper, near, found);
    for (int q = 0; q < found.position.cols(); ++q)
      if ((cells.empty() || cells.back().cell != found.cell[q]) && body->nearest(found.position.col(q)).gap < distance)
        cells.push_back({found.cell[q], body->curvature_radius()});
  }
  return cells;
}

std::vector<NearCell> Tool::near_cells(const fem::Mesh &mesh, double reach, double duration) const
{
  std::vector<NearCell> cells;
  for (const auto &body : bodies)
    for (const fem::BoundaryFace &face : mesh.boundary)
    {
      const Eigen::AlignedBox3d box = cell_box(mesh, face.cell);
      if (body->nearest(box.center()).gap < 0.5 * box.diagonal().norm() + reach + duration * body->speed())
        cells.push_back({face.cell, body->curvature_radius()});
    }
  return cells;
}

std::array<double, 2> Tool::platens() const
{
  if (settings.kind != ToolKind::platens)
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

double Tool::clearance(const ToolSettings &tool, const fem::FemSide &fem)
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
