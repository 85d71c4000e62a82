// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/multiplier_system.h"

#include "coupler/base/errors.h"
#include <algorithm>
#include <stdexcept>

namespace kerf
{
MultiplierSystem::MultiplierSystem(int dim, const std::vector<Row> &rows, const Eigen::Matrix3Xd &inverse_node_mass) : dim(dim)
{
  std::vector<Eigen::Triplet<double>> entries;
  const auto matrix_of = [&](const auto &measure)
  {
    entries.clear();
    for (std::size_t begin = 0, end; begin < rows.size(); begin = end)
    {
      // Consecutive rows with the same nodes are summed before they enter the matrix.
      const Row &first = rows[begin];
      double sum[8][8] = {};
      for (end = begin;
           end < rows.size() && rows[end].n == first.n && std::equal(first.node, first.node + first.n, rows[end].node); ++end)
        for (int a = 0; a < first.n; ++a)
          for (int b = 0; b < first.n; ++b)
            sum[a][b] += measure(rows[end]) * rows[end].N[a] * rows[end].N[b];
      for (int a = 0; a < first.n; ++a)
        for (int b = 0; b < first.n; ++b)
          entries.emplace_back(first.node[a], first.node[b], sum[a][b]);
    }
    Eigen::SparseMatrix<double> matrix(inverse_node_mass.cols(), inverse_node_mass.cols());
    matrix.setFromTriplets(entries.begin(), entries.end());
    return matrix;
  };
  node_matrix = matrix_of([](const Row &row) { return row.c; });
  Eigen::SparseMatrix<double> unit(node_matrix.rows(), node_matrix.cols());
  unit.setIdentity();

  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors;
  for (int axis = 0; axis < dim; ++axis)
  {
    const Eigen::VectorXd inverse_mass = inverse_node_mass.row(axis);
    const auto like_before = [axis](const Row &row) { return row.inverse_mass[axis] == row.inverse_mass[axis - 1]; };
    if (axis > 0 && inverse_mass.transpose() == inverse_node_mass.row(axis - 1) &&
        std::all_of(rows.begin(), rows.end(), like_before))
    {
      keep_factors(axis, factors);
      continue;
    }
    Eigen::SparseMatrix<double> A = matrix_of([&](const Row &row) { return row.c * row.c * row.inverse_mass[axis]; });
    A += Eigen::SparseMatrix<double>(node_matrix * inverse_mass.asDiagonal() * node_matrix);
    // A node with few particles in its support can leave its multiplier undetermined. Its value then has no effect.
    double largest = 0.;
    for (Eigen::Index a = 0; a < A.rows(); ++a)
      largest = std::max(largest, A.coeff(a, a));
    A += 1e-12 * largest * unit;
    if (axis == 0)
      factors.analyzePattern(A);
    factors.factorize(A);
    if (factors.info() != Eigen::Success)
      throw UnstableRun("the equations of the multipliers cannot be solved");
    keep_factors(axis, factors);
  }
}

void MultiplierSystem::keep_factors(int axis, const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> &factors)
{
  const Eigen::SparseMatrix<double> &L = factors.matrixL().nestedExpression();
  const auto n = static_cast<int>(L.cols());
  if (axis == 0)
  {
    place.assign(n, 0);
    for (int a = 0; a < n; ++a)
      place[a] = factors.permutationP().size() > 0 ? factors.permutationP().indices()[a] : a;
    first.assign(1, 0);
    row.clear();
    for (int k = 0; k < n; ++k)
    {
      for (Eigen::SparseMatrix<double>::InnerIterator entry(L, k); entry; ++entry)
        if (entry.row() > k)
          row.push_back(static_cast<int>(entry.row()));
      first.push_back(static_cast<int>(row.size()));
    }
    lower.resize(dim, row.size());
    inverse_diagonal.resize(dim, n);
  }
  for (int k = 0, at = 0; k < n; ++k)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(L, k); entry; ++entry)
      if (entry.row() > k)
        lower(axis, at++) = entry.value();
  inverse_diagonal.row(axis) = factors.vectorD().cwiseInverse();
}

template <int dim>
void MultiplierSystem::solve_in(Eigen::MatrixXd &values) const
{
  using Vector = Eigen::Matrix<double, dim, 1>;
  using View = Eigen::Map<Vector>;
  using ConstView = Eigen::Map<const Vector>;
  const auto n = static_cast<int>(place.size());
  permuted.resize(dim, n);
  double *x = permuted.data();
  for (int a = 0; a < n; ++a)
    View(x + dim * place[a]) = ConstView(values.data() + dim * a);
  for (int k = 0; k < n; ++k)
  {
    const Vector now = ConstView(x + dim * k);
    for (int at = first[k]; at < first[k + 1]; ++at)
      View(x + dim * row[at]) -= ConstView(lower.data() + dim * at).cwiseProduct(now);
  }
  for (int k = n - 1; k >= 0; --k)
  {
    Vector now = ConstView(inverse_diagonal.data() + dim * k).cwiseProduct(ConstView(x + dim * k));
    for (int at = first[k]; at < first[k + 1]; ++at)
      now -= ConstView(lower.data() + dim * at).cwiseProduct(ConstView(x + dim * row[at]));
    View(x + dim * k) = now;
  }
  for (int a = 0; a < n; ++a)
    View(values.data() + dim * a) = ConstView(x + dim * place[a]);
}

/// B is symmetric, so a column serves as the row.
template <int dim>
void MultiplierSystem::multiply_in(const Eigen::MatrixXd &values, Eigen::MatrixXd &result) const
{
  using Vector = Eigen::Matrix<double, dim, 1>;
  for (int a = 0; a < node_matrix.cols(); ++a)
  {
    Vector sum = Vector::Zero();
    for (Eigen::SparseMatrix<double>::InnerIterator entry(node_matrix, a); entry; ++entry)
      sum += entry.value() * Eigen::Map<const Vector>(values.data() + dim * entry.row());
    Eigen::Map<Vector>(result.data() + dim * a) = sum;
  }
}

void MultiplierSystem::solve(Eigen::MatrixXd &values) const
{
  dim == 2 ? solve_in<2>(values) : solve_in<3>(values);
}

void MultiplierSystem::multiply(const Eigen::MatrixXd &values, Eigen::MatrixXd &result) const
{
  result.resize(dim, values.cols());
  dim == 2 ? multiply_in<2>(values, result) : multiply_in<3>(values, result);
}
} // namespace kerf
