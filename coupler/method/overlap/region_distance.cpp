// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/region_distance.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace kerf
{
namespace
{
using Eigen::Vector3d;

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

RegionDistance::RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach)
  : mesh(mesh), points(points), reach(reach), phi(Eigen::VectorXd::Constant(points.cols(), reach)), bin_size(reach)
{
  Eigen::Array3i n_images;
  for (int c = 0; c < 3; ++c)
    n_images[c] = mesh.period[c] > 0. ? static_cast<int>(std::ceil(reach / mesh.period[c])) : 0;
  for (int z = -n_images[2]; z <= n_images[2]; ++z)
    for (int y = -n_images[1]; y <= n_images[1]; ++y)
      for (int x = -n_images[0]; x <= n_images[0]; ++x)
        images.push_back(Vector3d(x, y, z).cwiseProduct(mesh.period));
  if (points.cols() == 0)
    return;
  origin = points.rowwise().minCoeff();
  end = points.rowwise().maxCoeff();
  const Vector3d extent = end - origin;
  for (int c = 0; c < 3; ++c)
    n_bins[c] = static_cast<int>(extent[c] / bin_size) + 1;
  // Counting sort of the points by bin.
  const auto flat = [&](const Vector3d &x) { return (bin_of(x, 2) * n_bins[1] + bin_of(x, 1)) * n_bins[0] + bin_of(x, 0); };
  bin_start.assign(static_cast<std::size_t>(n_bins[0]) * n_bins[1] * n_bins[2] + 1, 0);
  for (int i = 0; i < points.cols(); ++i)
    ++bin_start[flat(points.col(i)) + 1];
  for (std::size_t b = 1; b < bin_start.size(); ++b)
    bin_start[b] += bin_start[b - 1];
  bin_points.resize(points.cols());
  std::vector<int> next(bin_start.begin(), bin_start.end() - 1);
  for (int i = 0; i < points.cols(); ++i)
    bin_points[next[flat(points.col(i))]++] = i;
}

int RegionDistance::bin_of(const Vector3d &point, int axis) const
{
  return std::clamp(static_cast<int>(std::floor((point[axis] - origin[axis]) / bin_size)), 0, n_bins[axis] - 1);
}

bool RegionDistance::bins_around(int cell, const Vector3d &shift, Eigen::Vector3i &first, Eigen::Vector3i &last) const
{
  if (points.cols() == 0)
    return false;
  const Eigen::AlignedBox3d box = cell_box(mesh, cell);
  const Vector3d lower = box.min().array() + shift.array() - reach, upper = box.max().array() + shift.array() + reach;
  if ((lower.array() > end.array()).any() || (upper.array() < origin.array()).any())
    return false;
  for (int axis = 0; axis < 3; ++axis)
  {
    first[axis] = bin_of(lower, axis);
    last[axis] = bin_of(upper, axis);
  }
  return true;
}

void RegionDistance::add_cell(int cell)
{
  const Eigen::AlignedBox3d box = cell_box(mesh, cell);
  for_each_near(cell,
                [&](const int i, const Vector3d &shift)
                {
                  const Vector3d place = points.col(i) - shift;
                  if (box.squaredExteriorDistance(place) < phi[i] * phi[i])
                    phi[i] = std::min(phi[i], distance_to_cell(mesh, cell, place));
                });
}
} // namespace kerf
