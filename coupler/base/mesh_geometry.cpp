// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/base/mesh_geometry.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
double distance_to_segment(const Vector3d &a, const Vector3d &b, const Vector3d &point)
{
  const Vector3d edge = b - a;
  const double s = std::clamp((point - a).dot(edge) / edge.squaredNorm(), 0., 1.);
  return (point - a - s * edge).norm();
}

double distance_to_triangle(const Vector3d &a, const Vector3d &b, const Vector3d &c, const Vector3d &point)
{
  const Vector3d normal = (b - a).cross(c - a);
  const auto inside = [&](const Vector3d &from, const Vector3d &to)
  { return (to - from).cross(point - from).dot(normal) >= 0.; };
  if (inside(a, b) && inside(b, c) && inside(c, a))
    return std::abs((point - a).dot(normal)) / normal.norm();
  return std::min({distance_to_segment(a, b, point), distance_to_segment(b, c, point), distance_to_segment(c, a, point)});
}

/// Corners in the order of their polygon; a face that is not plane counts as its two triangles.
double distance_to_quadrilateral(const std::array<Vector3d, 4> &corner, const Vector3d &point)
{
  return std::min(distance_to_triangle(corner[0], corner[1], corner[2], point),
                  distance_to_triangle(corner[0], corner[2], corner[3], point));
}

double distance_to_hexahedron(const fem::Mesh &mesh, int cell, const Vector3d &point)
{
  static constexpr int faces[6][4] = {{0, 2, 6, 4}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 3, 7, 6}, {0, 1, 3, 2}, {4, 5, 7, 6}};
  const Vector3d centre = cell_centre(mesh, cell);
  bool inside = true;
  double distance = 1e300;
  for (const auto &face : faces)
  {
    std::array<Vector3d, 4> corner;
    for (int k = 0; k < 4; ++k)
      corner[k] = mesh.nodes.col(mesh.cells(face[k], cell));
    const Vector3d middle = 0.25 * (corner[0] + corner[1] + corner[2] + corner[3]);
    const Vector3d normal = (corner[2] - corner[0]).cross(corner[3] - corner[1]);
    inside = inside && (point - middle).dot(normal) * (centre - middle).dot(normal) >= 0.;
    distance = std::min(distance, distance_to_quadrilateral(corner, point));
  }
  return inside ? 0. : distance;
}

double cross_z(const Vector3d &a, const Vector3d &b)
{
  return a[0] * b[1] - a[1] * b[0];
}
} // namespace

Vector3d cell_centre(const fem::Mesh &mesh, int cell)
{
  Vector3d centre = Vector3d::Zero();
  for (int a = 0; a < mesh.cells.rows(); ++a)
    centre += mesh.nodes.col(mesh.cells(a, cell)) / mesh.cells.rows();
  return centre;
}

Eigen::AlignedBox3d cell_box(const fem::Mesh &mesh, int cell)
{
  Eigen::AlignedBox3d box;
  for (int a = 0; a < mesh.cells.rows(); ++a)
    box.extend(mesh.nodes.col(mesh.cells(a, cell)));
  return box;
}

double distance_to_cell(const fem::Mesh &mesh, int cell, const Vector3d &point)
{
  if (mesh.dim == 3)
    return distance_to_hexahedron(mesh, cell, point);
  static constexpr std::array<int, 4> around = {{0, 1, 3, 2}}; // lexicographic corners in polygon order
  bool left = true, right = true;
  double distance = 1e300;
  for (int e = 0; e < 4; ++e)
  {
    const Vector3d a = mesh.nodes.col(mesh.cells(around[e], cell));
    const Vector3d b = mesh.nodes.col(mesh.cells(around[(e + 1) % 4], cell));
    const double side = cross_z(b - a, point - a);
    left = left && side >= 0.;
    right = right && side <= 0.;
    distance = std::min(distance, distance_to_segment(a, b, point));
  }
  return left || right ? 0. : distance;
}

double distance_to_face(const fem::Mesh &mesh, const fem::BoundaryFace &face, const Vector3d &point)
{
  if (mesh.dim == 3)
    return distance_to_quadrilateral({mesh.nodes.col(face.nodes[0]), mesh.nodes.col(face.nodes[1]),
                                      mesh.nodes.col(face.nodes[3]), mesh.nodes.col(face.nodes[2])},
                                     point);
  return distance_to_segment(mesh.nodes.col(face.nodes[0]), mesh.nodes.col(face.nodes[1]), point);
}

Box mesh_box(const fem::Mesh &mesh)
{
  return {mesh.nodes.rowwise().minCoeff(), mesh.nodes.rowwise().maxCoeff()};
}

std::vector<int> cells_inside(const fem::Mesh &mesh, const std::vector<Box> &boxes)
{
  std::vector<int> cells;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
  {
    const Vector3d centre = cell_centre(mesh, cell);
    // A centre on the border of a box is inside, whatever its round-off.
    const double slack = 1e-9 * cell_box(mesh, cell).diagonal().norm();
    for (const Box &box : boxes)
      if ((centre.array() >= box.lower.array() - slack).all() && (centre.array() <= box.upper.array() + slack).all())
      {
        cells.push_back(cell);
        break;
      }
  }
  return cells;
}
} // namespace kerf
