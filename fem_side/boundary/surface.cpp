// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/boundary/surface.h"

#include "fem_side/mesh/face_geometry.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
/// Round-off of coordinates, relative to the extent of a face: equal faces must have equal numbers of points.
constexpr double round_off = 1e-9;
/// Contact points of a mesh. More are a mistake in the spacing, and would fill the memory.
constexpr double most_points = 1e8;

[[noreturn]] void too_many_points(const double spacing)
{
  std::ostringstream message;
  message << "its surface has more than " << most_points << " contact points at a spacing of " << spacing
          << " m, which follows the particles, take larger ones";
  throw std::invalid_argument(message.str());
}

int parts_of(const double extent, const double spacing)
{
  if (!(spacing > 0.))
    return 1;
  const double parts = std::ceil((1. - round_off) * extent / (2. * spacing));
  if (!(parts <= most_points))
    too_many_points(spacing);
  return std::max(1, static_cast<int>(parts));
}

template <int dim>
struct FaceGeometry
{
  FaceGeometry(const Mesh &mesh, const BoundaryFace &face, const double spacing) : X(face_positions<dim>(mesh, face))
  {
    q1::Point<dim> inside = q1::Point<dim>::Zero();
    for (int a = 0; a < q1::n_nodes<dim>; ++a)
      inside += mesh.nodes.col(mesh.cells(a, face.cell)).template head<dim>() / q1::n_nodes<dim>;
    const q1::Point<dim - 1> middle = q1::Point<dim - 1>::Zero();
    const q1::Point<dim> outwards = X * q1::shape_values<dim - 1>(middle) - inside;
    turn = q1::area_vector<dim>(X, middle).dot(outwards) < 0. ? -1. : 1.;
    parts = parts_of((X.rowwise().maxCoeff() - X.rowwise().minCoeff()).maxCoeff(), spacing);
  }
  FacePoints points() const
  {
    const double share = std::pow(1. / parts, dim - 1);
    const int n_points = n_points_of_face<dim>(parts);
    FacePoints result{Eigen::Matrix3Xd::Zero(3, n_points), Eigen::Matrix3Xd::Zero(3, n_points)};
    int point = 0;
    for_each_gauss_point<dim>(parts,
                              [&](const q1::Point<dim - 1> &xi)
                              {
                                result.position.col(point).template head<dim>() = X * q1::shape_values<dim - 1>(xi);
                                result.area.col(point).template head<dim>() = turn * share * q1::area_vector<dim>(X, xi);
                                ++point;
                              });
    return result;
  }

  q1::NodalValues<dim - 1, dim> X;
  double turn = 1.;
  int parts = 1;
};
} // namespace

FacePoints face_points(const Mesh &mesh, const BoundaryFace &face, const double spacing)
{
  return mesh.dim == 2 ? FaceGeometry<2>(mesh, face, spacing).points() : FaceGeometry<3>(mesh, face, spacing).points();
}

template <int dim>
Surface<dim>::Surface(const NodalSpace<dim> &space, const double spacing)
{
  std::set<int> nodes;
  for (const BoundaryFace &face : space.mesh.boundary)
    for (int a = 0; a < n; ++a)
      if (space.owns(face.nodes[a]))
        nodes.insert(face.nodes[a]);
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      surface_dofs.push_back(space.local_dof(node) + c);

  std::vector<char> owned(space.mesh.n_cells(), 0);
  for (const int cell : space.owned_cells)
    owned[cell] = 1;
  std::vector<FacePoints> of_faces;
  int n_points = 0;
  for (std::size_t number = 0; number < space.mesh.boundary.size(); ++number)
  {
    const BoundaryFace &boundary = space.mesh.boundary[number];
    if (!owned[boundary.cell])
      continue;
    const FaceGeometry<dim> geometry(space.mesh, boundary, spacing);
    SurfaceFace<dim> face;
    face.number = static_cast<int>(number);
    face.cell = boundary.cell;
    for (int a = 0; a < n; ++a)
      face.dofs[a] = space.local_dof(boundary.nodes[a]);
    face.turn = geometry.turn;
    face.parts = geometry.parts;
    face.first_point = n_points;
    if (std::pow(2. * geometry.parts, dim - 1) + n_points > most_points)
      too_many_points(spacing);
    n_points += face.n_points();
    faces.push_back(face);
    positions.push_back(geometry.X);
    of_faces.push_back(geometry.points());
  }
  points.resize(3, n_points);
  areas.resize(3, n_points);
  for (std::size_t k = 0; k < faces.size(); ++k)
  {
    points.middleCols(faces[k].first_point, faces[k].n_points()) = of_faces[k].position;
    areas.middleCols(faces[k].first_point, faces[k].n_points()) = of_faces[k].area;
  }
  alpha = Eigen::VectorXd::Ones(n_points);
}

template <int dim>
void Surface<dim>::set_weights(const Eigen::VectorXd &weights)
{
  if (weights.size() != points.cols())
    throw std::logic_error("set_weights: not as many weights as points of the surface");
  alpha = weights;
  for (SurfaceFace<dim> &face : faces)
    face.has_weight = (alpha.segment(face.first_point, face.n_points()).array() > 0.).any();
}

template <int dim>
void Surface<dim>::find_points(const double *u, const double *v, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper,
                               const NearTest &near, SurfacePoints &found_points) const
{
  found.clear();
  std::vector<q1::NodalValues<dim - 1, dim>> current;
  for (std::size_t i = 0; i < faces.size(); ++i)
  {
    if (!faces[i].has_weight)
      continue;
    q1::NodalValues<dim - 1, dim> x = positions[i];
    for (int a = 0; a < n; ++a)
      x.col(a) += Eigen::Map<const q1::Point<dim>>(u + faces[i].dofs[a]);
    if ((x.rowwise().maxCoeff().array() < lower.template head<dim>().array()).any() ||
        (x.rowwise().minCoeff().array() > upper.template head<dim>().array()).any())
      continue;
    if (near)
    {
      // A multilinear face lies within the hull of its nodes. The ball is slightly larger so that points on its rim count.
      Eigen::Vector3d centre = Eigen::Vector3d::Zero();
      centre.template head<dim>() = x.rowwise().mean();
      const double radius = (x.colwise() - centre.template head<dim>()).colwise().norm().maxCoeff();
      if (!near(centre, (1. + 1e-9) * radius))
        continue;
    }
    found.push_back(static_cast<int>(i));
    current.push_back(x);
  }

  Eigen::Index n_points = 0;
  for (const int i : found)
    n_points += faces[i].n_points();
  found_points.position.setZero(3, n_points);
  found_points.velocity.setZero(3, n_points);
  found_points.area.resize(n_points);
  found_points.normal.setZero(3, n_points);
  found_points.weight.resize(n_points);
  found_points.cell.resize(n_points);
  Eigen::Index k = 0;
  for (std::size_t i = 0; i < found.size(); ++i)
  {
    const SurfaceFace<dim> &face = faces[found[i]];
    q1::NodalValues<dim - 1, dim> velocity;
    for (int a = 0; a < n; ++a)
      velocity.col(a) = Eigen::Map<const q1::Point<dim>>(v + face.dofs[a]);
    for_each_point(face,
                   [&](const q1::Point<dim - 1> &xi, const int point)
                   {
                     const auto N = q1::shape_values<dim - 1>(xi);
                     found_points.position.col(k).template head<dim>() = current[i] * N;
                     found_points.velocity.col(k).template head<dim>() = velocity * N;
                     found_points.area[k] = alpha[point] * areas.col(point).norm();
                     found_points.normal.col(k).template head<dim>() =
                       face.turn * q1::area_vector<dim>(current[i], xi).normalized();
                     found_points.weight[k] = alpha[point];
                     found_points.cell[k] = face.cell;
                     ++k;
                   });
  }
}

template <int dim>
void Surface<dim>::add_forces(const Eigen::Matrix3Xd &forces, double *f) const
{
  Eigen::Index point = 0;
  for (const int i : found)
    for_each_point(faces[i],
                   [&](const q1::Point<dim - 1> &xi, int)
                   {
                     if (point >= forces.cols())
                       throw std::logic_error("add_surface_forces: not as many forces as surface points");
                     const auto N = q1::shape_values<dim - 1>(xi);
                     for (int a = 0; a < n; ++a)
                       for (int c = 0; c < dim; ++c)
                         f[faces[i].dofs[a] + c] += N[a] * forces(c, point);
                     ++point;
                   });
  if (point != forces.cols())
    throw std::logic_error("add_surface_forces: not as many forces as surface points");
}

template class Surface<2>;
template class Surface<3>;
} // namespace kerf::fem
