// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/corrector/corrector.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <unordered_map>
#include <utility>

namespace kerf
{
Corrector::Corrector(const dem::Packing &packing, std::shared_ptr<const Fluctuations> fluctuations, const fem::FemSide &fem)
  : packing(packing), fluctuations(std::move(fluctuations)), recovered(fem)
{
}

std::vector<Corrector::Row> Corrector::rows(const std::vector<int> &particles) const
{
  return packing.dim == 2 ? rows_in<2>(particles) : rows_in<3>(particles);
}

namespace
{
/// The nodes that move the particles of a cell, and their shares in the gradient at each corner.
struct Surroundings
{
  std::vector<int> node;
  Eigen::Matrix3Xd share; // 8 columns for each node
};
} // namespace

template <int dim>
std::vector<Corrector::Row> Corrector::rows_in(const std::vector<int> &particles) const
{
  std::unordered_map<int, Surroundings> cells;
  const auto surroundings_of = [&](const fem::Interpolation &place) -> const Surroundings &
  {
    const auto entry = cells.emplace(place.cell, Surroundings());
    Surroundings &around = entry.first->second;
    if (!entry.second)
      return around;
    std::unordered_map<int, int> column;
    for (int a = 0; a < place.n; ++a)
    {
      column.emplace(place.nodes[a], static_cast<int>(column.size()));
      around.node.push_back(place.nodes[a]); // corners first
    }
    around.share.setZero(3, 8 * place.n);
    for (int a = 0; a < place.n; ++a)
      for (const RecoveredGradient::Entry &of_node : recovered.at(place.nodes[a]))
      {
        const auto known = column.emplace(of_node.node, static_cast<int>(column.size()));
        if (known.second)
        {
          around.node.push_back(of_node.node);
          around.share.conservativeResize(3, 8 * around.node.size());
          around.share.rightCols<8>().setZero();
        }
        around.share.col(8 * known.first->second + a) += of_node.share;
      }
    return around;
  };

  std::vector<Row> result(particles.size());
  for (std::size_t k = 0; k < particles.size(); ++k)
  {
    const fem::Interpolation &place = fluctuations->place(particles[k]);
    const Surroundings &around = surroundings_of(place);
    Row &row = result[k];
    row.node.reserve(around.node.size());
    row.P.reserve(around.node.size());
    for (std::size_t b = 0; b < around.node.size(); ++b)
    {
      Eigen::Vector3d gradient = Eigen::Vector3d::Zero(); // share of the node in the recovered gradient
      for (int a = 0; a < place.n; ++a)
        if (place.N[a] > 1e-12)
          gradient += place.N[a] * around.share.col(8 * b + a);
      const double N = b < static_cast<std::size_t>(place.n) && place.N[b] > 1e-12 ? place.N[b] : 0.;
      if (N == 0. && gradient.isZero(0.))
        continue;
      Eigen::Matrix3d P = Eigen::Matrix3d::Zero();
      for (int c = 0; c < dim; ++c)
        P(c, c) = N;
      for (int s = 0; s < StrainComponents<dim>::n; ++s)
      {
        const auto [p, q] = StrainComponents<dim>::axes[s];
        for (int c = 0; c < dim; ++c)
        {
          P(c, p) += fluctuations->of(particles[k], c, s) * gradient[q];
          if (p != q)
            P(c, q) += fluctuations->of(particles[k], c, s) * gradient[p];
        }
      }
      row.node.push_back(around.node[b]);
      row.P.push_back(P);
    }
  }
  return result;
}

void Corrector::place(std::vector<dem::NewParticle> &particles, const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v) const
{
  packing.dim == 2 ? place_in<2>(particles, u, v) : place_in<3>(particles, u, v);
}

template <int dim>
void Corrector::place_in(std::vector<dem::NewParticle> &particles, const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v) const
{
  using Eigen::Matrix3d;
  using Eigen::Vector3d;
  std::unordered_map<int, std::array<Matrix3d, 2>> at_nodes; // gradients of displacement and velocity
  const auto gradients_at = [&](int node) -> const std::array<Matrix3d, 2> &
  {
    const auto entry = at_nodes.emplace(node, std::array<Matrix3d, 2>{{Matrix3d::Zero(), Matrix3d::Zero()}});
    if (entry.second)
      for (const RecoveredGradient::Entry &around : recovered.at(node))
      {
        entry.first->second[0] += u.col(around.node) * around.share.transpose();
        entry.first->second[1] += v.col(around.node) * around.share.transpose();
      }
    return entry.first->second;
  };
  for (dem::NewParticle &particle : particles)
  {
    const fem::Interpolation &place = fluctuations->place(particle.index);
    if (place.cell < 0)
      continue;
    Matrix3d F = Matrix3d::Identity(), rate = Matrix3d::Zero(), E = rate, E_rate = rate;
    std::vector<int> carriers;
    for (int a = 0; a < place.n; ++a)
      if (place.N[a] > 1e-12)
      {
        const auto &[H, H_rate] = gradients_at(place.nodes[a]);
        E += 0.5 * place.N[a] * (H + H.transpose() + H.transpose() * H);
        E_rate += 0.5 * place.N[a] * (H_rate + H_rate.transpose() + H.transpose() * H_rate + H_rate.transpose() * H);
        carriers.push_back(place.nodes[a]);
      }
    const std::vector<int> turning = recovered.turning(place.cell, carriers);
    for (const int cell : turning)
    {
      const fem::Interpolation &centre = recovered.centre_of(cell);
      for (int a = 0; a < centre.n; ++a)
      {
        F += u.col(centre.nodes[a]) * centre.dN.col(a).transpose() / turning.size();
        rate += v.col(centre.nodes[a]) * centre.dN.col(a).transpose() / turning.size();
      }
    }
    Eigen::Matrix<double, 6, 1> moved = Eigen::Matrix<double, 6, 1>::Zero(), moving = moved; // displacements, then rotations
    for (int s = 0; s < StrainComponents<dim>::n; ++s)
    {
      const auto [p, q] = StrainComponents<dim>::axes[s];
      const double twice = p == q ? 1. : 2.;
      for (int c = 0; c < per_particle(); ++c)
      {
        const int component = dim == 2 && c == 2 ? 5 : c;
        moved[component] += fluctuations->of(particle.index, c, s) * twice * E(p, q);
        moving[component] += fluctuations->of(particle.index, c, s) * twice * E_rate(p, q);
      }
    }
    particle.displacement += F * moved.head<3>();
    particle.velocity += rate * moved.head<3>() + F * moving.head<3>();
    particle.rotation += F * moved.tail<3>();
    particle.angular_velocity += F * moving.tail<3>();
  }
}

namespace
{
/// Spectral norm of P.
double size_of(const Eigen::Matrix3d &P, int dim)
{
  if (dim == 3)
  {
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> squares;
    squares.computeDirect(P.transpose() * P, Eigen::EigenvaluesOnly);
    return std::sqrt(std::max(0., squares.eigenvalues()[2]));
  }
  const double sum = P.topLeftCorner<2, 2>().squaredNorm(), det = P(0, 0) * P(1, 1) - P(0, 1) * P(1, 0);
  return std::sqrt(0.5 * (sum + std::sqrt(std::max(0., sum * sum - 4. * det * det))));
}
} // namespace

std::vector<const Corrector::Lengths *> Corrector::lengths(const std::vector<int> &particles)
{
  std::unordered_map<int, Lengths> before = std::move(known_lengths);
  known_lengths.clear();
  std::vector<int> pending;
  for (const int i : particles)
  {
    const int change = recovered.last_change(fluctuations->place(i));
    const auto known = before.find(i);
    if (known != before.end() && known->second.known_at == change)
      known_lengths.emplace(i, std::move(known->second));
    else
    {
      pending.push_back(i);
      known_lengths[i].known_at = change;
    }
  }
  const std::vector<Row> added = rows(pending);
  for (std::size_t k = 0; k < pending.size(); ++k)
  {
    Lengths &row = known_lengths[pending[k]];
    row.node = added[k].node;
    for (const Eigen::Matrix3d &P : added[k].P)
      row.length.push_back(size_of(P, packing.dim));
  }
  std::vector<const Lengths *> result;
  for (const int i : particles)
    result.push_back(&known_lengths[i]);
  return result;
}

std::vector<double> inverse_masses_of_nodes(const std::vector<const Corrector::Lengths *> &rows,
                                            const std::vector<TiedParticle> &tied, const Eigen::VectorXd &node_mass)
{
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(node_mass.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (std::size_t b = 0; b < rows[k]->node.size(); ++b)
      shares[rows[k]->node[b]] += tied[k].share * rows[k]->length[b];
  std::vector<double> result;
  for (const Corrector::Lengths *row : rows)
  {
    double sum = 0.;
    for (std::size_t b = 0; b < row->node.size() && sum >= 0.; ++b)
    {
      const double mass = node_mass[row->node[b]];
      sum = mass > 0. ? sum + row->length[b] * shares[row->node[b]] / mass : -1.;
    }
    result.push_back(sum);
  }
  return result;
}
} // namespace kerf
