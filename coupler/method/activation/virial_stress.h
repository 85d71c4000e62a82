// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Stresses of cells: xx, yy, zz, yz, xz, xy [Pa], tension positive, one column for each cell of the mesh.
using CellStresses = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// In which cell of the mesh each stored particle lies, looked up when it is first asked for, and what the particles of a cell
/// are like.
class VirialStress
{
public:
  /// @p mesh and @p packing are kept by reference
  VirialStress(const fem::Mesh &mesh, const dem::Packing &packing, MPI_Comm comm)
    : mesh(mesh), packing(packing), comm(comm), solid(packing.solid_fraction()), cell_of(packing.size(), not_looked_up)
  {
  }

  /// By index in the packing: cells of @p target particles, -1 outside the mesh; others may be unknown. Not collective.
  const std::vector<int> &cells_of(const std::vector<char> &target, const fem::FemSide &fem);

  /// Mean Cauchy stress of the active particles in @p target cells, zero in others: the sum over their bonds of half of branch
  /// (x) force, over the volume of rock that they stand for. Weights are left out. Plane strain in two dimensions with
  /// Poisson's ratio @p poisson. Collective. Theory (7.14), (7.15).
  CellStresses stresses(const std::vector<char> &target, const fem::FemSide &fem, const dem::DemSide &dem, double poisson);

private:
  static constexpr int not_looked_up = -2;

  const fem::Mesh &mesh;
  const dem::Packing &packing;
  MPI_Comm comm;
  double solid; // fraction of the packing
  std::vector<int> cell_of;
};
} // namespace kerf
