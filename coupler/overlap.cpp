// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/overlap.h"

#include "coupler/weight.h"

namespace kerf
{
namespace
{
Eigen::Matrix3Xd cell_centres(const fem::Mesh &mesh)
{
  Eigen::Matrix3Xd centres(3, mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    centres.col(cell) = cell_centre(mesh, cell);
  return centres;
}
} // namespace

Overlap::Overlap(const fem::Mesh &mesh, const Eigen::Matrix3Xd &quadrature_points, const Eigen::Matrix3Xd &particles,
                 WeightFunction function, double width)
  : centres(cell_centres(mesh)), overlap_width(width), function(function), converted(mesh.n_cells(), 0),
    particle_distance(mesh, particles, width), quadrature_distance(mesh, quadrature_points, width),
    cell_distance(mesh, centres, width)
{
}

void Overlap::convert(const std::vector<int> &cells)
{
  for (const int cell : cells)
    if (!converted[cell])
    {
      converted[cell] = 1;
      ++n_converted_cells;
      particle_distance.add_cell(cell);
      quadrature_distance.add_cell(cell);
      cell_distance.add_cell(cell);
    }
}

Eigen::VectorXd Overlap::fe_weights() const
{
  return quadrature_distance.values().unaryExpr([this](double phi) { return fe_weight(function, phi, overlap_width); });
}

Eigen::VectorXd Overlap::de_weights() const
{
  return particle_distance.values().unaryExpr([this](double phi) { return 1. - fe_weight(function, phi, overlap_width); });
}
} // namespace kerf
