// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/case_checks.h"

#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/tool/tool_path.h"

#include <algorithm>
#include <array>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
using Kind = fem::BoundaryKind;

const char *name_of(Kind kind)
{
  static constexpr std::array<const char *, 7> names = {"free",     "fixed",   "roller",   "velocity",
                                                        "traction", "in_situ", "absorbing"};
  return names[static_cast<std::size_t>(kind)];
}

bool holds(Kind kind)
{
  return kind == Kind::fixed || kind == Kind::roller || kind == Kind::velocity;
}

/// Whether both may act on one face: tractions add up, and a roller or a dashpot leaves room for one.
bool agree(Kind a, Kind b)
{
  const auto given_force = [](Kind kind) { return kind == Kind::traction || kind == Kind::in_situ; };
  const auto takes_force = [](Kind kind) { return kind == Kind::traction || kind == Kind::roller || kind == Kind::absorbing; };
  if (a == b)
    return a == Kind::free || a == Kind::fixed || a == Kind::roller || a == Kind::traction;
  if ((a == Kind::absorbing && b == Kind::in_situ) || (a == Kind::in_situ && b == Kind::absorbing))
    return false; // the dashpots have this traction already
  return (given_force(a) && takes_force(b)) || (given_force(b) && takes_force(a));
}

Eigen::Vector3d centre_of(const fem::Mesh &mesh, const fem::BoundaryFace &face)
{
  const int n = 1 << (mesh.dim - 1);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int a = 0; a < n; ++a)
    sum += mesh.nodes.col(face.nodes[a]) / n;
  return sum;
}

std::ostream &operator<<(std::ostream &out, const Eigen::Vector3d &x)
{
  return out << '(' << x[0] << ", " << x[1] << ", " << x[2] << ") m";
}

/// For each face of the boundary the first condition that chose it, or -1. Throws InputError when two contradict each other.
std::vector<int> condition_of_faces(const Case &settings, const fem::Mesh &mesh)
{
  const auto &conditions = settings.body.boundary_conditions;
  std::vector<int> first(mesh.boundary.size(), -1);
  for (std::size_t c = 0; c < conditions.size(); ++c)
  {
    const std::vector<char> selected = fem::selected_faces(mesh, conditions[c]);
    for (std::size_t f = 0; f < selected.size(); ++f)
    {
      if (!selected[f])
        continue;
      if (first[f] < 0)
        first[f] = static_cast<int>(c);
      else if (const auto &other = conditions[first[f]]; !agree(other.kind, conditions[c].kind))
      {
        std::ostringstream text;
        text << settings.directory << "/case.prm: Boundary/Conditions: the face at " << centre_of(mesh, mesh.boundary[f])
             << " is given twice, " << name_of(other.kind) << " by " << other.name() << " and " << name_of(conditions[c].kind)
             << " by " << conditions[c].name() << ", which contradict each other";
        throw InputError(text.str());
      }
    }
  }
  return first;
}

/// Distance of a point from a box, zero inside [m].
double distance_to_box(const Box &box, const Eigen::Vector3d &x, int dim)
{
  double square = 0.;
  for (int c = 0; c < dim; ++c)
  {
    const double outside = std::max({box.lower[c] - x[c], x[c] - box.upper[c], 0.});
    square += outside * outside;
  }
  return std::sqrt(square);
}

/// Distance that is always left between the disc and the box of the mesh [m].
double least_distance(const Case &settings, const Box &box)
{
  const ToolPath path(settings.tool.path, settings.tool.smoothing_time);
  double least = std::numeric_limits<double>::infinity();
  const auto look = [&](double time)
  {
    if (time <= settings.end_time)
      least = std::min(least, distance_to_box(box, path.position(std::max(time, 0.)), 2) - settings.tool.radius);
  };
  constexpr int n_places = 1000;
  for (int k = 0; k <= n_places; ++k)
    look(settings.end_time * k / n_places);
  for (const auto &point : settings.tool.path)
    look(point.first);
  return least;
}
} // namespace

void check_conditions_on_surface(const Case &settings, const fem::Mesh &mesh, const dem::Packing &packing)
{
  const auto &conditions = settings.body.boundary_conditions;
  const std::vector<int> condition = condition_of_faces(settings, mesh);
  const double near = packing.mean_diameter;
  for (std::size_t c = 0; c < conditions.size(); ++c)
  {
    if (conditions[c].kind == Kind::free)
      continue;
    Box faces{Eigen::Vector3d::Constant(1e300), Eigen::Vector3d::Constant(-1e300)};
    for (std::size_t f = 0; f < mesh.boundary.size(); ++f)
      if (condition[f] == static_cast<int>(c))
        for (const int node : mesh.boundary[f].nodes)
          if (node >= 0)
          {
            faces.lower = faces.lower.cwiseMin(mesh.nodes.col(node));
            faces.upper = faces.upper.cwiseMax(mesh.nodes.col(node));
          }
    bool found = false;
    for (int i = 0; i < packing.size() && !found; ++i)
    {
      const Eigen::Vector3d place = packing.positions.col(i);
      found = (place.array() >= faces.lower.array() - near).all() && (place.array() <= faces.upper.array() + near).all();
    }
    if (!found)
      throw InputError(
        settings.directory + "/case.prm: Boundary/Conditions: " + name_of(conditions[c].kind) + " on " + conditions[c].name() +
        " holds or loads no particle, since Packing/Surface does not reach that side of the mesh; take it out, or "
        "give the shape as Mesh/File");
  }
}

void check_settings(const Case &settings, Mode mode, const fem::Mesh &mesh)
{
  condition_of_faces(settings, mesh);
  const std::string file = settings.directory + "/case.prm: ";
  if (!settings.packing_surface_file.empty() && (mode == Mode::adaptive || mode == Mode::fixed))
    throw InputError(
      file + "Packing/Surface: is for mode dem, since finite elements fill the whole mesh; give the shape as Mesh/File");
  const auto &conditions = settings.body.boundary_conditions;
  const bool stressed = settings.body.initial_stress.norm() > 0.;
  for (const fem::BoundaryCondition &condition : conditions)
    if (condition.kind == Kind::in_situ && !stressed)
      throw InputError(file + "Boundary/Conditions: in_situ on " + condition.name() +
                       " holds Loads/Initial stress, which is not given");
  const Box box = mesh_box(mesh);
  for (std::size_t k = 0; k < settings.body.mesh.refined.size(); ++k)
  {
    const fem::RefinedBox &refined = settings.body.mesh.refined[k];
    for (int c = 0; c < mesh.dim; ++c)
      if (refined.upper[c] <= box.lower[c] || refined.lower[c] >= box.upper[c])
      {
        std::ostringstream text;
        text << file << "Mesh/Refine: box " << k + 1 << " lies outside of the mesh, which reaches from " << box.lower << " to "
             << box.upper;
        throw InputError(text.str());
      }
  }
  if ((mode == Mode::adaptive || mode == Mode::fixed) && settings.overlap.width < settings.packing.mean_diameter)
  {
    std::ostringstream text;
    text << file << "Coupling/Overlap width: the overlap of " << settings.overlap.width
         << " m is narrower than a particle, give at least Packing/Mean diameter = " << settings.packing.mean_diameter;
    throw InputError(text.str());
  }
}

std::vector<std::string> doubts(const Case &settings, Mode mode, const fem::Mesh &mesh)
{
  std::vector<std::string> result;
  const auto &conditions = settings.body.boundary_conditions;
  const Box box = mesh_box(mesh);
  if (settings.body.initial_stress.norm() > 0.)
  {
    // Only a face whose normal the stress acts on moves.
    const std::vector<int> condition = condition_of_faces(settings, mesh);
    for (std::size_t f = 0; f < mesh.boundary.size(); ++f)
      if (condition[f] < 0 || conditions[condition[f]].kind == Kind::free)
      {
        const fem::BoundaryFace &face = mesh.boundary[f];
        const Eigen::Vector3d edge = mesh.nodes.col(face.nodes[1]) - mesh.nodes.col(face.nodes[0]);
        const Eigen::Vector3d other = mesh.dim == 2
                                        ? Eigen::Vector3d::UnitZ()
                                        : Eigen::Vector3d(mesh.nodes.col(face.nodes[2]) - mesh.nodes.col(face.nodes[0]));
        const Eigen::Vector3d normal = edge.cross(other).normalized();
        if ((settings.body.initial_stress * normal).norm() < 1e-6 * settings.body.initial_stress.norm())
          continue;
        std::ostringstream text;
        text << "Loads/Initial stress acts on free faces, such as that at " << centre_of(mesh, face)
             << ": they move at the start; in_situ, absorbing, fixed and roller hold it";
        result.push_back(text.str());
        break;
      }
  }
  const double strain = settings.activation.tensile_strength / settings.body.material.young;
  if (constexpr double of_rock = 0.05; strain > of_rock) // rocks fail in tension at some 1e-4 to 1e-3
  {
    std::ostringstream text;
    text << "Rock/Young modulus = " << settings.body.material.young << " Pa: the rock would fail at a strain of " << strain
         << ", rocks fail below " << of_rock << "; units are SI";
    result.push_back(text.str());
  }
  if (settings.tool.kind == ToolKind::disc)
    if (const double distance = least_distance(settings, box); distance > 0.)
    {
      std::ostringstream text;
      text << "Tool/Path: the disc stays at least " << distance << " m away from the rock until Time/End time";
      result.push_back(text.str());
    }
  if (settings.tool.kind == ToolKind::platens)
    for (const fem::BoundaryCondition &condition : conditions)
      if (holds(condition.kind))
      {
        result.push_back("Boundary/Conditions: " + std::string(name_of(condition.kind)) + " on " + condition.name() +
                         " holds a specimen that the platens load; a free specimen has no conditions");
        break;
      }
  if (mode == Mode::adaptive && settings.activation.sigma_star > settings.activation.tensile_strength)
  {
    std::ostringstream text;
    text << "Adaptivity/Sigma star: sigma* = " << settings.activation.sigma_star / 1e6
         << " MPa is above the tensile strength of " << settings.activation.tensile_strength / 1e6
         << " MPa: cells stay elastic where the rock should have failed";
    result.push_back(text.str());
  }
  return result;
}
} // namespace kerf
