// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/packing_quality.h"

#include "dem_side/geometry/cell_list.h"
#include "dem_side/packing/laguerre.h"
#include "dem_side/packing/solid_region.h"

#include <Eigen/Eigenvalues>

namespace kerf::dem
{
namespace
{
double largest_overlap(const Packing &packing)
{
  double largest = 0.;
  CellList(packing.positions, 2. * packing.radii.maxCoeff(), packing.periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        const double distance = packing.branch(i, j).norm();
        largest = std::max(largest, packing.radii[i] + packing.radii[j] - distance);
      });
  return largest;
}
} // namespace

PackingQuality measure_quality(const Packing &packing)
{
  PackingQuality quality;
  if (packing.size() == 0)
    return quality;
  quality.solid_fraction = packing.solid_fraction();
  quality.coordination = packing.coordination();
  quality.largest_overlap = largest_overlap(packing) / packing.mean_diameter;

  const auto [lower, upper] = filled_box(packing);
  std::vector<char> in_core(packing.size(), 0);
  int n_core = 0;
  for (int i = 0; i < packing.size(); ++i)
  {
    const Eigen::Vector3d x = packing.positions.col(i);
    double inside = 1e300;
    for (int c = 0; c < packing.dim; ++c)
      if (packing.periodic[c] == 0.)
        inside = std::min({inside, x[c] - lower[c], upper[c] - x[c]});
    in_core[i] = inside > 3. * packing.mean_diameter;
    n_core += in_core[i];
  }
  if (n_core == 0) // too small for a core
    return quality;

  const Eigen::VectorXd cells = laguerre_volumes(packing, in_core);
  double solid = 0.;
  for (int i = 0; i < packing.size(); ++i)
    solid += in_core[i] ? packing.volume(i) : 0.;
  quality.core_solid_fraction = solid / cells.sum();

  Eigen::Matrix3d fabric = Eigen::Matrix3d::Zero();
  long ends = 0;
  for (const auto &[i, j] : packing.bonds)
  {
    const int ends_in_core = in_core[i] + in_core[j];
    const Eigen::Vector3d n = packing.branch(i, j).normalized();
    fabric += ends_in_core * n * n.transpose();
    ends += ends_in_core;
  }
  quality.core_coordination = double(ends) / n_core;
  if (ends > 0)
  {
    const Eigen::MatrixXd tensor = fabric.topLeftCorner(packing.dim, packing.dim) / double(ends);
    quality.fabric.head(packing.dim) = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(tensor).eigenvalues();
    quality.isotropy = quality.fabric[0] / quality.fabric[packing.dim - 1];
  }
  return quality;
}
} // namespace kerf::dem
