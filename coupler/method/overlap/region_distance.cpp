// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/region_distance.h"

#include "coupler/base/mesh_geometry.h"

#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

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
