// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <memory>
#include <vector>

namespace kerf
{
/// The equations of the weak constraint, for every node a of the overlap
///   sum_i c_i N_ia (v_i - sum_b N_ib v_b) = 0,   c_i the volume of the particle inside the overlap.
/// Forces -c_i sum_a N_ia lambda_a on particles and (B lambda)_a on nodes, B = N^T c N, enforce it with
///   A lambda = momentum gap/dt,   A = N^T c^2/m N + B M^-1 B.
/// One component of displacement; masses may be infinite.
class MultiplierEquations
{
public:
  /// One row for every tied particle of the model.
  struct Row
  {
    double c = 0.;            ///< [m^3], 2D [m^2]
    double inverse_mass = 0.; ///< of the particle [1/kg]
    int n = 0;
    const int *node = nullptr; ///< n places among the nodes of the overlap
    const double *N = nullptr; ///< n shape functions
  };

  /// @param inverse_node_mass [1/kg], zero where a node's motion is prescribed
  MultiplierEquations(const std::vector<Row> &rows, const Eigen::VectorXd &inverse_node_mass);

  Eigen::VectorXd solve(const Eigen::VectorXd &right_hand_side) const { return factors->solve(right_hand_side); }
  const Eigen::SparseMatrix<double> &B() const { return node_matrix; }

private:
  Eigen::SparseMatrix<double> node_matrix;
  // Not movable, hence the pointer.
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> factors;
};
} // namespace kerf
