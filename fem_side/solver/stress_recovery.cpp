// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/stress_recovery.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace kerf::fem
{
namespace
{
using Stresses = Eigen::Matrix<double, 6, Eigen::Dynamic>;
using Stress = Eigen::Matrix<double, 6, 1>;

/// Stresses of all cells on every rank; cells without weight are marked.
struct AllCells
{
  Stresses sigma;
  Eigen::VectorXd present;
};

AllCells gather_cells(const CellStress &stress, const int n_cells, MPI_Comm comm)
{
  AllCells all{Stresses::Zero(6, n_cells), Eigen::VectorXd::Zero(n_cells)};
  for (std::size_t i = 0; i < stress.cell.size(); ++i)
  {
    all.sigma.col(stress.cell[i]) = stress.sigma.col(static_cast<Eigen::Index>(i));
    all.present[stress.cell[i]] = 1.;
  }
  MPI_Allreduce(MPI_IN_PLACE, all.sigma.data(), 6 * n_cells, MPI_DOUBLE, MPI_SUM, comm);
  MPI_Allreduce(MPI_IN_PLACE, all.present.data(), n_cells, MPI_DOUBLE, MPI_SUM, comm);
  return all;
}

void add_neighbours(const Mesh &mesh, const Eigen::VectorXd &present, std::vector<int> &cells)
{
  const std::vector<int> inner = cells;
  for (const int cell : inner)
    for (const int other : mesh.neighbours[cell])
      if (present[other] > 0. && std::find(cells.begin(), cells.end(), other) == cells.end())
        cells.push_back(other);
}

Eigen::Vector3d centre(const Mesh &mesh, const int cell)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int a = 0; a < mesh.cells.rows(); ++a)
    sum += mesh.nodes.col(mesh.cells(a, cell));
  return sum / static_cast<double>(mesh.cells.rows());
}

/// Value at @p point of the best linear fit through the cells' centres; their mean if they determine no slope.
template <int dim>
Stress fitted(const Mesh &mesh, const AllCells &all, std::vector<int> cells, const Eigen::Vector3d &point)
{
  using Matrix = Eigen::Matrix<double, dim + 1, dim + 1>;
  Stress mean = Stress::Zero();
  for (const int cell : cells)
    mean += all.sigma.col(cell) / static_cast<double>(cells.size());
  const int first = cells.front();
  const double scale = (mesh.nodes.col(mesh.cells(mesh.cells.rows() - 1, first)) - mesh.nodes.col(mesh.cells(0, first))).norm();
  for (int extension = 0; extension < 3; ++extension)
  {
    Matrix A = Matrix::Zero();
    Eigen::Matrix<double, dim + 1, 6> b = Eigen::Matrix<double, dim + 1, 6>::Zero();
    for (const int cell : cells)
    {
      const Eigen::Vector3d offset = (centre(mesh, cell) - point) / scale; // of order one
      Eigen::Matrix<double, dim + 1, 1> row;
      row[0] = 1.;
      for (int d = 0; d < dim; ++d)
        row[d + 1] = offset[d];
      A += row * row.transpose();
      b += row * all.sigma.col(cell).transpose();
    }
    // Only the first row of the inverse is needed. If some slope is undetermined the determinant is round-off.
    if (A.determinant() > 1e-12 * std::pow(A.trace(), dim + 1))
      return (A.inverse().row(0) * b).transpose();
    add_neighbours(mesh, all.present, cells);
  }
  return mean;
}
} // namespace

Stresses recover_stress(const Mesh &mesh, const CellStress &stress, MPI_Comm comm)
{
  const AllCells all = gather_cells(stress, mesh.n_cells(), comm);
  int rank = 0, n_ranks = 1;
  MPI_Comm_rank(comm, &rank);
  MPI_Comm_size(comm, &n_ranks);
  std::vector<std::vector<int>> cells_at(mesh.n_nodes());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (all.present[cell] > 0.)
      for (int a = 0; a < mesh.cells.rows(); ++a)
        if (mesh.cells(a, cell) % n_ranks == rank)
          cells_at[mesh.cells(a, cell)].push_back(cell);

  Stresses result = Stresses::Zero(6, mesh.n_nodes());
  for (int node = 0; node < mesh.n_nodes(); ++node)
    if (!cells_at[node].empty())
      result.col(node) = mesh.dim == 2 ? fitted<2>(mesh, all, cells_at[node], mesh.nodes.col(node))
                                       : fitted<3>(mesh, all, cells_at[node], mesh.nodes.col(node));
  MPI_Allreduce(MPI_IN_PLACE, result.data(), 6 * mesh.n_nodes(), MPI_DOUBLE, MPI_SUM, comm);
  for (const SlaveNode &slave : mesh.slaves) // continuous across halved neighbours
  {
    result.col(slave.node).setZero();
    for (std::size_t k = 0; k < slave.masters.size(); ++k)
      result.col(slave.node) += slave.weights[k] * result.col(slave.masters[k]);
  }
  return result;
}
} // namespace kerf::fem
