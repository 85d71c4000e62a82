// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/boundary/surface.h"

#include "fem_side/mesh/face_geometry.h"

#include <cmath>
#include <map>
#include <set>
#include <stdexcept>

namespace kerf::fem
{
template <int dim>
template <typename Visit>
void Surface<dim>::for_each_point(const SurfaceFace<dim> &face, const Visit &visit)
{
  const double part = 1. / face.parts;
  const double weight = std::pow(part, dim - 1);
  const int n_parts = static_cast<int>(std::lround(std::pow(face.parts, dim - 1)));
  for (int s = 0; s < n_parts; ++s)
    for (int p = 0; p < n; ++p)
    {
      q1::Point<dim - 1> xi = part * q1::gauss_point<dim - 1>(p);
      for (int d = 0, rest = s; d < dim - 1; ++d, rest /= face.parts)
        xi[d] += -1. + part * (2 * (rest % face.parts) + 1);
      visit(xi, weight);
    }
}

template <int dim>
Surface<dim>::Surface(const NodalSpace<dim> &space, double spacing)
{
  std::set<int> nodes;
  for (const BoundaryFace &face : space.mesh.boundary)
    for (int a = 0; a < n; ++a)
      if (space.owns(face.nodes[a]))
        nodes.insert(face.nodes[a]);
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      surface_dofs.push_back(space.local_dof(node) + c);

  std::map<int, int> owned_number;
  for (std::size_t c = 0; c < space.owned_cells.size(); ++c)
    owned_number[space.owned_cells[c]] = c;
  for (std::size_t number = 0; number < space.mesh.boundary.size(); ++number)
  {
    const BoundaryFace &boundary = space.mesh.boundary[number];
    const auto cell = owned_number.find(boundary.cell);
    if (cell == owned_number.end())
      continue;
    SurfaceFace<dim> face;
    face.number = static_cast<int>(number);
    face.owned_cell = cell->second;
    face.cell = boundary.cell;
    const auto X = face_positions<dim>(space.mesh, boundary);
    const q1::Point<dim> outwards = X * q1::shape_values<dim - 1>(q1::Point<dim - 1>::Zero()) -
                                    space.cell_nodes(boundary.cell) * q1::shape_values<dim>(q1::Point<dim>::Zero());
    for (int a = 0; a < n; ++a)
    {
      face.dofs[a] = space.local_dof(boundary.nodes[a]);
      const q1::Point<dim> area = q1::area_vector<dim>(X, q1::gauss_point<dim - 1>(a));
      face.area[a] = area.norm();
      face.turn = area.dot(outwards) < 0. ? -1. : 1.;
      face.normal[a] = area.normalized() * face.turn;
    }
    const double extent = (X.rowwise().maxCoeff() - X.rowwise().minCoeff()).maxCoeff();
    face.parts = spacing > 0. ? std::max(1, static_cast<int>(std::ceil(extent / (2. * spacing)))) : 1;
    faces.push_back(face);
    positions.push_back(X);
  }
}

template <int dim>
void Surface<dim>::set_weights(const Eigen::VectorXd &alpha)
{
  constexpr int n_points = q1::n_nodes<dim>;
  for (SurfaceFace<dim> &face : faces)
    face.alpha = alpha.segment<n_points>(face.owned_cell * n_points).mean();
}

template <int dim>
void Surface<dim>::find_points(const double *u, const double *v, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper,
                               const NearTest &near, SurfacePoints &points) const
{
  found.clear();
  std::vector<q1::NodalValues<dim - 1, dim>> current;
  for (std::size_t i = 0; i < faces.size(); ++i)
  {
    if (faces[i].alpha == 0.)
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
    n_points += n * std::lround(std::pow(faces[i].parts, dim - 1));
  points.position.setZero(3, n_points);
  points.velocity.setZero(3, n_points);
  points.area.resize(n_points);
  points.normal.setZero(3, n_points);
  points.weight.resize(n_points);
  points.cell.resize(n_points);
  Eigen::Index point = 0;
  for (std::size_t k = 0; k < found.size(); ++k)
  {
    const SurfaceFace<dim> &face = faces[found[k]];
    q1::NodalValues<dim - 1, dim> velocity;
    for (int a = 0; a < n; ++a)
      velocity.col(a) = Eigen::Map<const q1::Point<dim>>(v + face.dofs[a]);
    for_each_point(face,
                   [&](const q1::Point<dim - 1> &xi, double weight)
                   {
                     const auto N = q1::shape_values<dim - 1>(xi);
                     points.position.col(point).template head<dim>() = current[k] * N;
                     points.velocity.col(point).template head<dim>() = velocity * N;
                     points.area[point] = weight * face.alpha * q1::area_vector<dim>(positions[found[k]], xi).norm();
                     points.normal.col(point).template head<dim>() =
                       face.turn * q1::area_vector<dim>(current[k], xi).normalized();
                     points.weight[point] = face.alpha;
                     points.cell[point] = face.cell;
                     ++point;
                   });
  }
}

template <int dim>
void Surface<dim>::add_forces(const Eigen::Matrix3Xd &forces, double *f) const
{
  Eigen::Index point = 0;
  for (const int i : found)
    for_each_point(faces[i],
                   [&](const q1::Point<dim - 1> &xi, double)
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
