// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/cell_kernel.h"
#include "tests/support/fem_fixture.h"

#include <Eigen/Dense>

/// Small meshes for tests of the cell kernel alone; nodal vectors are dim x n_nodes.
namespace kerf::fem::test
{
template <int dim>
struct CellMesh
{
  static constexpr int n = q1::n_nodes<dim>;
  using Point = q1::Point<dim>;
  using Nodal = Eigen::Matrix<double, dim, Eigen::Dynamic>;
  using Index = Eigen::Matrix<int, dim, 1>;

  Index n_cells_along; ///< cells in each direction
  Nodal X;             ///< [m]
  std::vector<std::array<int, n>> cells;
  std::vector<std::array<double, n>> alpha;

  /// A structured block of cells of size @p h.
  CellMesh(const Index &n_cells, const Point &h) : n_cells_along(n_cells)
  {
    Index n_nodes = n_cells + Index::Ones();
    X.resize(dim, n_nodes.prod());
    for (int i = 0; i < X.cols(); ++i)
      X.col(i) = index_of(i, n_nodes).template cast<double>().cwiseProduct(h);
    for (int c = 0; c < n_cells.prod(); ++c)
    {
      const Index low = index_of(c, n_cells);
      std::array<int, n> nodes;
      for (int a = 0; a < n; ++a)
      {
        int number = 0;
        for (int d = dim - 1; d >= 0; --d)
          number = number * n_nodes[d] + low[d] + (a >> d & 1);
        nodes[a] = number;
      }
      cells.push_back(nodes);
    }
    alpha.assign(cells.size(), {});
    for (auto &weights : alpha)
      weights.fill(1.);
  }

  static Index index_of(int number, const Index &extent)
  {
    Index index;
    for (int d = 0; d < dim; ++d, number /= extent[d - 1])
      index[d] = number % extent[d];
    return index;
  }
  bool inside(const int node) const
  {
    const Index index = index_of(node, n_cells_along + Index::Ones());
    return (index.array() > 0).all() && (index.array() < n_cells_along.array()).all();
  }
  Nodal noise(const double size, const std::uint64_t seed) const
  {
    return noise_field(X.cols(), size, seed, dim).template topRows<dim>();
  }
  /// Moves inner nodes by up to @p size in each direction.
  void distort(const double size)
  {
    const Nodal shift = noise(size, 3);
    for (int i = 0; i < X.cols(); ++i)
      if (inside(i))
        X.col(i) += shift.col(i);
  }
  void uneven_weights()
  {
    for (std::size_t c = 0; c < cells.size(); ++c)
      for (int q = 0; q < n; ++q)
        alpha[c][q] = 0.55 + 0.45 * test::noise(8 * c + q);
  }

  CellKernel<dim> kernel(const Strain strain, const Integration integration, const Material &material = rock()) const
  {
    CellKernel<dim> result(material, strain, integration);
    for (std::size_t c = 0; c < cells.size(); ++c)
    {
      std::array<int, n> dofs;
      q1::NodalValues<dim> positions;
      for (int a = 0; a < n; ++a)
      {
        dofs[a] = dim * cells[c][a];
        positions.col(a) = X.col(cells[c][a]);
      }
      result.add_cell(dofs, positions, alpha[c]);
    }
    return result;
  }
  Nodal forces(const CellKernel<dim> &kernel, const Nodal &u) const
  {
    Nodal f = Nodal::Zero(dim, X.cols());
    kernel.subtract_internal_forces(u.data(), f.data());
    return f;
  }
  /// The matrix of the linear operator, column by column.
  Eigen::MatrixXd stiffness(const CellKernel<dim> &kernel) const
  {
    const Eigen::Index size = X.size();
    Eigen::MatrixXd K = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd u = Eigen::VectorXd::Zero(size), f(size);
    for (Eigen::Index i = 0; i < size; ++i)
    {
      u[i] = 1.;
      f.setZero();
      kernel.subtract_linear_forces(u.data(), f.data());
      K.col(i) = -f;
      u[i] = 0.;
    }
    return K;
  }
};
} // namespace kerf::fem::test
