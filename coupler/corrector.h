// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing.h"
#include "dem_side/stored_bonds.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// How the particles of a random packing fluctuate about a smooth field, by the strain of the field: C_i of
///   K C + W^T lambda = -K (eps x),   W C = 0,   W = N^T m,
/// for each unit strain eps of the bonded packing as it lies in the store, with its free surfaces. The mean around every node
/// stays that of the field, so only what the cells cannot resolve is left. Two dimensions.
class Corrector
{
public:
  /// A particle's displacement [m] and rotation [rad] by the displacements of nodes: sum_b P_b u_b with rows x, y, rotation.
  struct Row
  {
    std::vector<int> node; ///< of the mesh
    std::vector<Eigen::Matrix<double, 3, 2>> P;
  };

  /// @param packing and @param fem are kept by reference
  Corrector(const dem::Packing &packing, double k_n, double k_t, const fem::FemSide &fem);

  /// Rows N + C : B_rec of particles. B_rec is the mean over the cells around a node of the strains at their centres,
  /// interpolated with N; cells whose nodes do not all have mass do not count, as such nodes rest.
  /// @param node_mass by node [kg]
  std::vector<Row> rows(const std::vector<int> &particles, const Eigen::VectorXd &node_mass) const;

  /// Displacement and rotation of particle @p i for unit strains xx, yy and 2 xy [m], [rad].
  Eigen::Matrix3d of(int i) const { return fluctuation.middleRows<3>(3 * i); }

private:
  void solve(const dem::Packing &packing, double k_n, double k_t);

  const dem::Packing &packing;
  const fem::FemSide &fem;
  Eigen::MatrixX3d fluctuation;
  std::vector<fem::Interpolation> centre; // of each cell
  std::vector<std::vector<int>> cells_of_node;
};
} // namespace kerf
