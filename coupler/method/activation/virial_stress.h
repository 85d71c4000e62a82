// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Stresses of cells xx, yy, zz, yz, xz, xy [Pa], tension positive, one column for each cell.
using CellStresses = Eigen::Matrix<double, 6, Eigen::Dynamic>;

/// Mean stress of the particles in every cell, and the cell in which every stored particle lies. A particle is located at the
/// first request.
class VirialStress
{
public:
  /// @p mesh and @p packing are kept by reference.
  VirialStress(const fem::Mesh &mesh, const dem::Packing &packing, MPI_Comm comm)
    : mesh(mesh), packing(packing), comm(comm), solid(packing.solid_fraction()), cell_of(packing.size(), not_looked_up)
  {
  }

  /// Cells of the @p target particles by index in the packing, -1 outside the mesh. Entries of other particles may be
  /// undefined. Not collective.
  const std::vector<int> &cells_of(const std::vector<char> &target, const fem::FemSide &fem);

  /// Mean Cauchy stress of the active particles in the @p target cells, zero in other cells. It is the sum over the bonds of
  /// half of branch (x) force, divided by the volume of rock of the particles. Weights do not enter. In two dimensions sigma_zz
  /// is that of plane strain with Poisson's ratio @p poisson. Collective. Theory (7.14), (7.15).
  CellStresses stresses(const std::vector<char> &target, const fem::FemSide &fem, const dem::DemSide &dem, double poisson);

private:
  static constexpr int not_looked_up = -2;

  const fem::Mesh &mesh;
  const dem::Packing &packing;
  MPI_Comm comm;
  double solid; // solid fraction of the packing
  std::vector<int> cell_of;
};
} // namespace kerf
