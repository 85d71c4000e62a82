// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/corrector/fluctuations.h"

#include "coupler/base/errors.h"
#include "coupler/method/constraint/corrector/strain_components.h"
#include "dem_side/bond_network/network_operator.h"
#include "dem_side/packing/stored_bonds.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <cmath>
#include <numeric>
#include <stdexcept>

namespace kerf
{
Fluctuations::Fluctuations(const dem::Packing &packing, double k_n, double k_t, const fem::FemSide &fem)
  : per_particle(packing.dim == 2 ? 3 : 6), places(fem.locate(packing.positions))
{
  packing.dim == 2 ? solve<2>(packing, k_n, k_t, fem.mesh().n_nodes()) : solve<3>(packing, k_n, k_t, fem.mesh().n_nodes());
}

/// Conjugate gradients in the subspace W C = 0, preconditioned by the diagonal of K. Theory (6.1) - (6.3).
template <int dim>
void Fluctuations::solve(const dem::Packing &packing, double k_n, double k_t, int n_nodes)
{
  using Components = StrainComponents<dim>;
  const int n = packing.size();
  std::vector<int> all(n);
  std::iota(all.begin(), all.end(), 0);
  const dem::StoredBonds bonds(packing);
  const dem::NetworkOperator network(packing, bonds, dem::NetworkOperator::Material{k_n, k_t, 1.}, all, std::vector<char>(n, 1),
                                     Eigen::VectorXd::Ones(n));
  Eigen::VectorXd scale = network.diagonal(); // D^-1/2; zero for particles without bonds, which are excluded from the means
  // In a lattice the loads cancel up to round-off. Loads below this value count as zero.
  const double nothing = 1e-24 * scale.sum() * packing.mean_diameter * packing.mean_diameter;
  scale = scale.unaryExpr([](double k) { return k > 0. ? 1. / std::sqrt(k) : 0.; });

  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i < n; ++i)
    for (int a = 0; a < places[i].n; ++a)
      for (int c = 0, dof = per_particle * i; c < dim; ++c, ++dof)
        entries.emplace_back(dim * places[i].nodes[a] + c, dof, places[i].N[a] * packing.volume(i) * scale[dof]);
  Eigen::SparseMatrix<double> W(dim * n_nodes, network.n_dofs());
  W.setFromTriplets(entries.begin(), entries.end());
  Eigen::SparseMatrix<double> S = W * Eigen::SparseMatrix<double>(W.transpose());
  const double largest = S.diagonal().maxCoeff();
  Eigen::SparseMatrix<double> unit(S.rows(), S.cols());
  unit.setIdentity();
  S += 1e-12 * largest * unit; // for nodes without particles
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(S);
  const auto project = [&](Eigen::VectorXd &y) { y -= W.transpose() * factors.solve(W * y); };

  constexpr double tolerance = 1e-7;
  constexpr int most = 3000;
  fluctuation.setZero(network.n_dofs(), Components::n);
  for (int k = 0; k < Components::n; ++k)
  {
    const auto [first, second] = Components::axes[k];
    Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
    strain(first, second) += 0.5;
    strain(second, first) += 0.5;
    Eigen::VectorXd load = Eigen::VectorXd::Zero(network.n_dofs());
    network.add_homogeneous(strain, load);
    Eigen::VectorXd r = -scale.cwiseProduct(load), y = Eigen::VectorXd::Zero(r.size());
    project(r);
    Eigen::VectorXd p = r;
    double rr = r.squaredNorm();
    const double start = rr;
    for (int iteration = 0; rr > std::max(tolerance * tolerance * start, nothing); ++iteration)
    {
      if (iteration == most)
        throw UnstableRun("the fluctuations of the packing about a uniform strain do not converge");
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
    fluctuation.col(k) = scale.cwiseProduct(y).cast<float>();
  }
}
} // namespace kerf
