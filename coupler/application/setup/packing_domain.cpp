// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/packing_domain.h"

#include "coupler/base/errors.h"

#include <algorithm>
#include <map>
#include <sstream>
#include <stdexcept>

namespace kerf
{
namespace
{
/// Corners of a face in circular order, with the hanging nodes of refined neighbours on its edges, so that the surface has no
/// gaps.
std::vector<int> outline(const fem::BoundaryFace &face, const std::map<std::pair<int, int>, int> &middle_of)
{
  static constexpr int around[4] = {0, 1, 3, 2}; // lexicographic order: 0 1 along one side, 2 3 along the opposite one
  std::vector<int> corners;
  std::size_t first = 0; // start at a hanging node if there is one, so that no triangle of the fan is degenerate
  for (int k = 0; k < 4; ++k)
  {
    const int from = face.nodes[around[k]], to = face.nodes[around[(k + 1) % 4]];
    corners.push_back(from);
    const auto middle = middle_of.find(std::minmax(from, to));
    if (middle != middle_of.end())
    {
      first = corners.size();
      corners.push_back(middle->second);
    }
  }
  std::rotate(corners.begin(), corners.begin() + static_cast<std::ptrdiff_t>(first), corners.end());
  return corners;
}

dem::SurfaceMesh boundary_of(const fem::Mesh &mesh)
{
  dem::SurfaceMesh surface;
  surface.points = mesh.nodes;
  std::map<std::pair<int, int>, int> middle_of;
  for (const fem::SlaveNode &slave : mesh.slaves)
    if (slave.masters.size() == 2)
      middle_of[std::minmax(slave.masters[0], slave.masters[1])] = slave.node;
  for (const fem::BoundaryFace &face : mesh.boundary)
    if (mesh.dim == 2)
      surface.facets.push_back({{face.nodes[0], face.nodes[1], -1}});
    else
    {
      const std::vector<int> corners = outline(face, middle_of);
      for (std::size_t k = 1; k + 1 < corners.size(); ++k)
        surface.facets.push_back({{corners[0], corners[k], corners[k + 1]}});
    }
  return surface;
}

/// Whether all boundary faces lie in the sides of the bounding box.
bool is_box(const fem::Mesh &mesh, const Box &box)
{
  const Eigen::Vector3d slack = 1e-6 * (box.upper - box.lower);
  for (const fem::BoundaryFace &face : mesh.boundary)
  {
    bool in_side = false;
    for (int c = 0; c < mesh.dim; ++c)
    {
      bool in_lower = true, in_upper = true;
      for (int a = 0; a < (mesh.dim == 2 ? 2 : 4); ++a)
      {
        in_lower = in_lower && mesh.nodes(c, face.nodes[a]) < box.lower[c] + slack[c];
        in_upper = in_upper && mesh.nodes(c, face.nodes[a]) > box.upper[c] - slack[c];
      }
      in_side = in_side || in_lower || in_upper;
    }
    if (!in_side)
      return false;
  }
  return true;
}
} // namespace

PackingDomain find_packing_domain(const Case &settings, const fem::Mesh &mesh)
{
  const Box around = mesh_box(mesh);
  const bool from_file = !settings.packing_surface_file.empty();
  const std::string section = settings.directory + "/case.prm: Packing/Surface: ";
  if (from_file && mesh.dim == 2)
    throw InputError(section + "an STL surface needs a mesh in three dimensions; leave it empty in two");
  PackingDomain space;
  if ((mesh.period.array() > 0.).any())
  {
    if (from_file)
      throw InputError(section + "a periodic packing fills a box; leave it empty with Mesh/Periodic");
    if (!is_box(mesh, around))
      throw InputError(settings.directory +
                       "/case.prm: Mesh/Periodic: a periodic packing fills a box, the mesh has another shape");
    space.box = around;
    space.volume = dem::box_volume(mesh.dim, around.lower, around.upper);
    return space;
  }
  try
  {
    const dem::SurfaceMesh surface = from_file ? dem::read_stl(settings.packing_surface_file) : boundary_of(mesh);
    const dem::ClosedSurface closed(mesh.dim, surface, settings.packing.mean_diameter);
    closed.check_one_body();
    space.box = {closed.lower(), closed.upper()};
    space.volume = closed.volume();
    const double volume_around = dem::box_volume(mesh.dim, around.lower, around.upper);
    if (from_file || space.volume < (1. - 1e-6) * volume_around)
    {
      space.surface = std::make_shared<dem::SurfaceMesh>(surface);
      space.shape = closed.moments();
    }
    else
      space.volume = volume_around;
  }
  catch (const std::invalid_argument &error)
  {
    throw InputError((from_file ? section : settings.directory + "/case.prm: Mesh: ") + error.what());
  }
  for (int c = 0; from_file && c < mesh.dim; ++c)
  {
    const double slack = 1e-6 * (around.upper[c] - around.lower[c]);
    if (space.box.lower[c] < around.lower[c] - slack || space.box.upper[c] > around.upper[c] + slack)
    {
      std::ostringstream text;
      text << section << settings.packing_surface_file << " reaches from " << space.box.lower[c] << " to " << space.box.upper[c]
           << " m along "
           << "xyz"[c] << ", it must be inside of the mesh, " << around.lower[c] << " to " << around.upper[c];
      throw InputError(text.str());
    }
  }
  return space;
}

Specimen find_specimen(const Case &settings, const fem::Mesh &mesh, Mode mode)
{
  Specimen result;
  result.box = mesh_box(mesh);
  const bool from_file = mode == Mode::dem && !settings.packing_surface_file.empty();
  if (!from_file && (is_box(mesh, result.box) || (mesh.period.array() > 0.).any()))
  {
    const Eigen::Vector3d extent = result.box.upper - result.box.lower;
    result.section = extent[0] * (mesh.dim == 3 ? extent[2] : 1.);
    return result;
  }
  const std::string key = from_file ? "Packing/Surface" : "Mesh";
  try
  {
    const double reach = 1e-3 * (result.box.upper - result.box.lower).maxCoeff(); // distances are not asked for
    const auto body = std::make_shared<const dem::ClosedSurface>(
      mesh.dim, from_file ? dem::read_stl(settings.packing_surface_file) : boundary_of(mesh), reach);
    result.box = {body->lower(), body->upper()};
    result.contains = [body](const Eigen::Vector3d &place) { return body->contains(place); };
    const auto section = [&](double share)
    { return body->section((1. - share) * body->lower()[1] + share * body->upper()[1]); };
    result.section = section(0.5);
    constexpr double alike = 0.01;
    for (const double share : {0.02, 0.25, 0.75, 0.98})
      if (!(std::abs(section(share) - result.section) <= alike * result.section))
        result.form = Specimen::Form::other;
  }
  catch (const std::invalid_argument &error)
  {
    throw InputError(settings.directory + "/case.prm: " + key + ": " + error.what());
  }
  if (!from_file && settings.body.mesh.gmsh_file.empty() && settings.body.mesh.shape == fem::MeshShape::disc)
  {
    // Of the circle, which the polygon of the cells does not fill.
    result.form = Specimen::Form::disc;
    result.flat_angle = settings.body.mesh.flat_angle;
    const Eigen::Vector3d extent = result.box.upper - result.box.lower;
    result.section = extent[0] * (mesh.dim == 3 ? extent[2] : 1.);
  }
  return result;
}
} // namespace kerf
