// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <array>
#include <vector>

namespace kerf
{
/// The equations of the weak constraint. For every node a of the overlap
///   sum_i c_i N_ia (v_i - sum_b N_ib v_b) = 0,   c_i the volume of the particle inside the overlap.
/// Forces -c_i sum_a N_ia lambda_a on particles and (B lambda)_a on nodes, B = N^T c N, enforce it with
///   A lambda = momentum gap/dt,   A = N^T c^2/m N + B M^-1 B.
/// Each displacement component has its own masses, which may be infinite. The matrices of the components have the same sparsity
/// pattern, so the components are solved together. Theory (5.9), (5.12).
class MultiplierSystem
{
public:
  /// One row for each tied particle of the model.
  struct Row
  {
    double c = 0.;                        ///< [m^3] (2D: [m^2])
    std::array<double, 3> inverse_mass{}; ///< inverse mass of the particle in each direction [1/kg]
    int n = 0;
    const int *node = nullptr; ///< n positions in the list of overlap nodes
    const double *N = nullptr; ///< n shape functions
  };

  /// @param inverse_node_mass [1/kg], zero where the motion of a node is prescribed. Throws UnstableRun when A is singular.
  MultiplierSystem(int dim, const std::vector<Row> &rows, const Eigen::Matrix3Xd &inverse_node_mass);

  /// Solves A x = values. @param values dim rows, one column for each node; the solution on return
  void solve(Eigen::MatrixXd &values) const;
  /// result = B values
  void multiply(const Eigen::MatrixXd &values, Eigen::MatrixXd &result) const;

private:
  template <int dim>
  void solve_in(Eigen::MatrixXd &values) const;
  template <int dim>
  void multiply_in(const Eigen::MatrixXd &values, Eigen::MatrixXd &result) const;
  void keep_factors(int axis, const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> &factors);

  int dim;
  Eigen::SparseMatrix<double> node_matrix; // B
  // A = P^T L D L^T P of each component. The columns of L below the diagonal are stored consecutively.
  std::vector<int> place, first, row;
  Eigen::MatrixXd lower, inverse_diagonal; // dim rows
  mutable Eigen::MatrixXd permuted;
};
} // namespace kerf
