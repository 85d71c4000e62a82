// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/corrected_penalty.h"

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

std::vector<double> inverse_masses_of_nodes(const std::vector<Corrector::Row> &rows, const std::vector<TiedParticle> &tied,
                                            const Eigen::VectorXd &node_mass)
{
  const auto size = [](const Eigen::Matrix<double, 3, 2> &P)
  { return Eigen::JacobiSVD<Eigen::Matrix2d>(P.topRows<2>()).singularValues()[0]; };
  Eigen::VectorXd shares = Eigen::VectorXd::Zero(node_mass.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    for (std::size_t b = 0; b < rows[k].node.size(); ++b)
      shares[rows[k].node[b]] += tied[k].share * size(rows[k].P[b]);
  std::vector<double> result;
  for (const Corrector::Row &row : rows)
  {
    double sum = 0.;
    for (std::size_t b = 0; b < row.node.size() && sum >= 0.; ++b)
      sum = node_mass[row.node[b]] > 0. ? sum + size(row.P[b]) * shares[row.node[b]] / node_mass[row.node[b]] : -1.;
    result.push_back(sum);
  }
  return result;
}

CorrectedPenalty::CorrectedPenalty(const Settings &settings, const dem::Packing &packing) : settings(settings), packing(packing)
{
}

const Corrector &CorrectedPenalty::corrector_for(const fem::FemSide &fem)
{
  if (!corrector)
    corrector = std::make_unique<Corrector>(packing, settings.k_n, settings.k_t, fem);
  return *corrector;
}

void CorrectedPenalty::set_particles(const std::vector<TiedParticle> &particles)
{
  tied = particles;
  stale = true;
}

/// Rows of all tied particles on every rank: their nodes reach a cell farther than those of a particle's own.
void CorrectedPenalty::renew(fem::FemSide &fem)
{
  const Eigen::VectorXd node_mass = fem.gather(fem::NodalField::mass).row(0);
  std::vector<int> indices;
  row_of.assign(packing.size(), -1);
  for (const TiedParticle &particle : tied)
  {
    row_of[particle.index] = static_cast<int>(indices.size());
    indices.push_back(particle.index);
  }
  rows = corrector_for(fem).rows(indices, node_mass);
  others = inverse_masses_of_nodes(rows, tied, node_mass);
  std::vector<int> column(node_mass.size(), -1);
  window.clear();
  for (Corrector::Row &row : rows)
    for (int &node : row.node)
    {
      if (column[node] < 0)
      {
        column[node] = static_cast<int>(window.size());
        window.push_back(node);
      }
      node = column[node];
    }
  fem.set_window(window);
  stale = false;
}

void CorrectedPenalty::apply(dem::Phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (tied.empty())
    return;
  if (stale)
    renew(fem);
  fem.read_window(fem::NodalField::displacement, node_displacement);
  node_force.setZero(3, window.size());
  spring.setZero(particles.n);
  for (int i = 0; i < particles.n; ++i)
  {
    const int k = row_of[particles.index[i]];
    if (k < 0 || others[k] < 0.)
      continue;
    const Corrector::Row &row = rows[k];
    const double stiffness = penalty_stiffness(settings.penalty, tied[k].share, 1. / (1. / particles.mass[i] + others[k]));
    spring[i] = stiffness;
    Eigen::Vector2d smooth = Eigen::Vector2d::Zero();
    for (std::size_t b = 0; b < row.node.size(); ++b)
      smooth += row.P[b].topRows<2>() * node_displacement.col(row.node[b]).head<2>();
    const Vector3d moved = packing.displacement(particles.index[i], particles.position.col(i));
    Vector3d chi = Vector3d::Zero();
    chi.head<2>() = moved.head<2>() - smooth;
    chi = packing.shortest(chi);
    const Vector3d force = -stiffness * chi;
    particles.force.col(i) += force;
    for (std::size_t b = 0; b < row.node.size(); ++b)
      node_force.col(row.node[b]).head<2>() -= row.P[b].topRows<2>().transpose() * force.head<2>();
    stored += 0.5 * stiffness * chi.squaredNorm();
  }
  fem.add_window_forces(node_force);
}

void CorrectedPenalty::place(std::vector<dem::NewParticle> &particles, const fem::FemSide &fem)
{
  std::vector<int> indices;
  for (const dem::NewParticle &particle : particles)
    indices.push_back(particle.index);
  const Eigen::VectorXd node_mass = fem.gather(fem::NodalField::mass).row(0);
  const Eigen::Matrix3Xd u = fem.gather(fem::NodalField::displacement), v = fem.gather(fem::NodalField::velocity);
  const std::vector<Corrector::Row> placing = corrector_for(fem).rows(indices, node_mass);
  for (std::size_t k = 0; k < particles.size(); ++k)
  {
    Vector3d moved = Vector3d::Zero(), rate = moved;
    for (std::size_t b = 0; b < placing[k].node.size(); ++b)
    {
      moved += placing[k].P[b] * u.col(placing[k].node[b]).head<2>();
      rate += placing[k].P[b] * v.col(placing[k].node[b]).head<2>();
    }
    particles[k].displacement.head<2>() = moved.head<2>();
    particles[k].rotation[2] = moved[2];
    particles[k].velocity.head<2>() = rate.head<2>();
    particles[k].angular_velocity[2] = rate[2];
  }
}

Eigen::VectorXd CorrectedPenalty::springs() const
{
  return spring;
}
} // namespace kerf
