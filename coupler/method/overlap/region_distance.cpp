// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/region_distance.h"

#include "coupler/base/mesh_geometry.h"

#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

RegionDistance::RegionDistance(const fem::Mesh &mesh, const Eigen::Matrix3Xd &points, double reach)
  : mesh(mesh), points(points), reach(reach), phi(Eigen::VectorXd::Constant(points.cols(), reach))
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
  bins.lower = points.rowwise().minCoeff();
  bins.cell_size = reach;
  end = points.rowwise().maxCoeff();
  const Vector3d extent = end - bins.lower;
  for (int c = 0; c < 3; ++c)
    bins.n_cells[c] = static_cast<int>(extent[c] / reach) + 1;
  std::vector<int> bin_of(points.cols());
  for (int i = 0; i < points.cols(); ++i)
    bin_of[i] = bins.index(bins.cell_at(Vector3d(points.col(i))));
  sorted = dem::CellSort(bin_of, bins.size());
}

bool RegionDistance::bins_around(int cell, const Vector3d &shift, std::array<int, 3> &first, std::array<int, 3> &last) const
{
  if (points.cols() == 0)
    return false;
  const Eigen::AlignedBox3d box = cell_box(mesh, cell);
  const Vector3d lower = box.min().array() + shift.array() - reach, upper = box.max().array() + shift.array() + reach;
  if ((lower.array() > end.array()).any() || (upper.array() < bins.lower.array()).any())
    return false;
  first = bins.cell_at(lower);
  last = bins.cell_at(upper);
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
