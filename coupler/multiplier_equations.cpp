// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/multiplier_equations.h"

#include <stdexcept>

namespace kerf
{
MultiplierEquations::MultiplierEquations(const std::vector<Row> &rows, const Eigen::VectorXd &inverse_node_mass)
  : factors(std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>())
{
  std::vector<Eigen::Triplet<double>> c_entries, mobility_entries;
  for (const Row &row : rows)
    for (int a = 0; a < row.n; ++a)
      for (int b = 0; b < row.n; ++b)
      {
        const double NN = row.N[a] * row.N[b];
        c_entries.emplace_back(row.node[a], row.node[b], row.c * NN);
        mobility_entries.emplace_back(row.node[a], row.node[b], row.c * row.c * row.inverse_mass * NN);
      }
  const Eigen::Index n = inverse_node_mass.size();
  node_matrix.resize(n, n);
  node_matrix.setFromTriplets(c_entries.begin(), c_entries.end());
  Eigen::SparseMatrix<double> A(n, n);
  A.setFromTriplets(mobility_entries.begin(), mobility_entries.end());
  A += Eigen::SparseMatrix<double>(node_matrix * inverse_node_mass.asDiagonal() * node_matrix);

  // Nodes with few particles near them leave a multiplier undetermined; it does nothing then, whatever its value.
  double largest = 0.;
  for (Eigen::Index a = 0; a < n; ++a)
    largest = std::max(largest, A.coeff(a, a));
  Eigen::SparseMatrix<double> unit(n, n);
  unit.setIdentity();
  A += 1e-12 * largest * unit;
  factors->compute(A);
  if (factors->info() != Eigen::Success)
    throw std::runtime_error("the equations of the multipliers cannot be solved");
}
} // namespace kerf
