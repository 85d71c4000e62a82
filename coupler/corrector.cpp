// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/corrector.h"

#include "coupler/region_distance.h"
#include "dem_side/network_operator.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <numeric>
#include <stdexcept>

namespace kerf
{
Corrector::Corrector(const dem::Packing &packing, double k_n, double k_t, const fem::FemSide &fem) : packing(packing), fem(fem)
{
  const fem::Mesh &mesh = fem.mesh();
  Eigen::Matrix3Xd points(3, mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    points.col(cell) = cell_centre(mesh, cell);
  centre = fem.locate(points);
  cells_of_node.resize(mesh.n_nodes());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int a = 0; a < centre[cell].n; ++a)
      cells_of_node[centre[cell].nodes[a]].push_back(cell);
  solve(packing, k_n, k_t);
}

/// Conjugate gradients among the motions that leave the means, scaled by the diagonal of K.
void Corrector::solve(const dem::Packing &packing, double k_n, double k_t)
{
  const int n = packing.size();
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  const dem::StoredBonds bonds(packing);
  const dem::NetworkOperator network(packing, bonds, dem::NetworkOperator::Material{k_n, k_t, 1.}, all, std::vector<char>(n, 1),
                                     Eigen::VectorXd::Ones(n));
  Eigen::VectorXd scale = network.diagonal(); // D^-1/2; loose particles have no stiffness and no part in the means
  scale = scale.unaryExpr([](double k) { return k > 0. ? 1. / std::sqrt(k) : 0.; });

  const std::vector<fem::Interpolation> place = fem.locate(packing.positions);
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < place[i].n; ++a)
      for (int c = 0; c < 2; ++c)
        entries.emplace_back(2 * place[i].nodes[a] + c, 3 * i + c, place[i].N[a] * packing.volume(i) * scale[3 * i + c]);
  Eigen::SparseMatrix<double> W(2 * fem.mesh().n_nodes(), network.n_dofs());
  W.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> S = W * Eigen::SparseMatrix<double>(W.transpose());
  const double largest = S.diagonal().maxCoeff();
  Eigen::SparseMatrix<double> unit(S.rows(), S.cols());
  unit.setIdentity();
  S += 1e-12 * largest * unit; // nodes without particles
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(S);
  const auto project = [&](Eigen::VectorXd &y) { y -= W.transpose() * factors.solve(W * y); };

  constexpr double tolerance = 1e-7;
  constexpr int most = 3000;
  fluctuation.setZero(network.n_dofs(), 3);
  for (int k = 0; k < 3; ++k)
  {
    Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
    if (k < 2)
      strain(k, k) = 1.;
    else
      strain(0, 1) = strain(1, 0) = 0.5;
    Eigen::VectorXd load = Eigen::VectorXd::Zero(network.n_dofs());
    network.add_homogeneous(strain, load);
    Eigen::VectorXd r = -scale.cwiseProduct(load), y = Eigen::VectorXd::Zero(r.size());
    project(r);
    Eigen::VectorXd p = r;
    double rr = r.squaredNorm();
    const double start = rr;
    for (int iteration = 0; rr > tolerance * tolerance * start; ++iteration)
    {
      if (iteration == most)
        throw std::runtime_error("the fluctuations of the packing about a uniform strain do not converge");
      Eigen::VectorXd Kp = Eigen::VectorXd::Zero(r.size());
      network.add_product(scale.cwiseProduct(p), Kp);
      Kp = scale.cwiseProduct(Kp);
      project(Kp);
      const double step = rr / p.dot(Kp);
      y += step * p;
      r -= step * Kp;
      const double next = r.squaredNorm();
      p = r + next / rr * p;
      rr = next;
    }
    fluctuation.col(k) = scale.cwiseProduct(y);
  }
}

std::vector<Corrector::Row> Corrector::rows(const std::vector<int> &particles, const Eigen::VectorXd &node_mass) const
{
  std::vector<char> counts(centre.size());
  for (std::size_t cell = 0; cell < centre.size(); ++cell)
    counts[cell] = std::all_of(centre[cell].nodes.begin(), centre[cell].nodes.begin() + centre[cell].n,
                               [&](int node) { return node_mass[node] > 0.; });
  Eigen::Matrix3Xd points(3, particles.size());
  for (std::size_t k = 0; k < particles.size(); ++k)
    points.col(k) = packing.positions.col(particles[k]);
  const std::vector<fem::Interpolation> found = fem.locate(points);

  std::vector<Row> result(particles.size());
  for (std::size_t k = 0; k < particles.size(); ++k)
  {
    Row &row = result[k];
    std::vector<Eigen::Vector2d> gradient; // of the recovered field, by node
    const auto at = [&](int node)
    {
      const auto place = std::find(row.node.begin(), row.node.end(), node) - row.node.begin();
      if (place == static_cast<std::ptrdiff_t>(row.node.size()))
      {
        row.node.push_back(node);
        row.P.push_back(Eigen::Matrix<double, 3, 2>::Zero());
        gradient.push_back(Eigen::Vector2d::Zero());
      }
      return place;
    };
    for (int a = 0; a < found[k].n; ++a)
    {
      if (found[k].N[a] <= 1e-12)
        continue;
      const auto own = at(found[k].nodes[a]);
      row.P[own](0, 0) += found[k].N[a];
      row.P[own](1, 1) += found[k].N[a];
      row.P[own](2, 0) -= 0.5 * found[k].dN(1, a);
      row.P[own](2, 1) += 0.5 * found[k].dN(0, a);
      int n_cells = 0;
      for (const int cell : cells_of_node[found[k].nodes[a]])
        n_cells += counts[cell];
      for (const int cell : cells_of_node[found[k].nodes[a]])
        if (counts[cell])
          for (int b = 0; b < centre[cell].n; ++b)
            gradient[at(centre[cell].nodes[b])] += found[k].N[a] / n_cells * centre[cell].dN.col(b).head<2>();
    }
    const Eigen::Matrix3d C = of(particles[k]);
    for (std::size_t b = 0; b < row.node.size(); ++b)
    {
      row.P[b].col(0) += C.col(0) * gradient[b][0] + C.col(2) * gradient[b][1];
      row.P[b].col(1) += C.col(1) * gradient[b][1] + C.col(2) * gradient[b][0];
    }
  }
  return result;
}
} // namespace kerf
