// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/region_distance.h"

#include <algorithm>
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

double distance_to_cell(const fem::Mesh &mesh, int cell, const Vector3d &point)
{
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
  return distance_to_segment(mesh.nodes.col(face.nodes[0]), mesh.nodes.col(face.nodes[1]), point);
}

RegionDistance::RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach)
  : mesh(mesh), points(points), reach(reach), phi(Eigen::VectorXd::Constant(points.cols(), reach)), bin_size(reach)
{
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

void RegionDistance::add_cell(int cell)
{
  if (points.cols() == 0)
    return;
  // Images within reach of the points, however many periods that are.
  Eigen::Array3i n_images;
  for (int c = 0; c < 3; ++c)
    n_images[c] = mesh.period[c] > 0. ? static_cast<int>(std::ceil(reach / mesh.period[c])) : 0;
  for (int z = -n_images[2]; z <= n_images[2]; ++z)
    for (int y = -n_images[1]; y <= n_images[1]; ++y)
      for (int x = -n_images[0]; x <= n_images[0]; ++x)
        add_image(cell, Vector3d(x, y, z).cwiseProduct(mesh.period));
}

void RegionDistance::add_image(int cell, const Vector3d &shift)
{
  Vector3d lower = mesh.nodes.col(mesh.cells(0, cell)), upper = lower;
  for (int a = 1; a < mesh.cells.rows(); ++a)
  {
    lower = lower.cwiseMin(mesh.nodes.col(mesh.cells(a, cell)));
    upper = upper.cwiseMax(mesh.nodes.col(mesh.cells(a, cell)));
  }
  lower.array() += shift.array() - reach;
  upper.array() += shift.array() + reach;
  if ((lower.array() > end.array()).any() || (upper.array() < origin.array()).any())
    return;
  for (int z = bin_of(lower, 2); z <= bin_of(upper, 2); ++z)
    for (int y = bin_of(lower, 1); y <= bin_of(upper, 1); ++y)
      for (int x = bin_of(lower, 0); x <= bin_of(upper, 0); ++x)
      {
        const int bin = (z * n_bins[1] + y) * n_bins[0] + x;
        for (int k = bin_start[bin]; k < bin_start[bin + 1]; ++k)
        {
          const int i = bin_points[k];
          if (phi[i] > 0.)
            phi[i] = std::min(phi[i], distance_to_cell(mesh, cell, points.col(i) - shift));
        }
      }
}
} // namespace kerf
