// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/coupled_operator.h"

#include "coupler/base/mpi_helpers.h"
#include "coupler/base/noise.h"

#include <algorithm>
#include <cmath>

namespace kerf
{
namespace
{
bool contains(const Box &box, const Eigen::Vector3d &point)
{
  return (point.array() >= box.lower.array()).all() && (point.array() <= box.upper.array()).all();
}
} // namespace

Box part_around(const fem::Mesh &mesh, const std::vector<int> &cells, double reach)
{
  Box box{Eigen::Vector3d::Constant(1e300), Eigen::Vector3d::Constant(-1e300)};
  for (const int cell : cells)
    for (int a = 0; a < mesh.cells.rows(); ++a)
    {
      box.lower = box.lower.cwiseMin(mesh.nodes.col(mesh.cells(a, cell)));
      box.upper = box.upper.cwiseMax(mesh.nodes.col(mesh.cells(a, cell)));
    }
  box.lower.array() -= reach;
  box.upper.array() += reach;
  return box;
}

double reach_of_overlap(const ModelSettings &settings, const Constraint &constraint)
{
  const double cells = constraint.cells_around();
  return settings.overlap.width + cells * settings.body.mesh.cell_size + 2. * settings.mean_diameter;
}

CoupledOperator::CoupledOperator(const dem::NetworkOperator::Material &bonds, Constraint &constraint, const fem::FemSide &fem,
                                 const dem::Packing &packing, const Overlap &overlap, const std::vector<TiedParticle> &tied,
                                 const std::vector<char> &active, const Box &part, MPI_Comm comm)
  : constraint(constraint), dim(packing.dim)
{
  add_cells(fem, part, comm);
  first_particle_dof = dim * static_cast<int>(nodes.size());
  for (int i = 0; i < packing.size(); ++i)
    if (active[i] && contains(part, packing.positions.col(i)))
      particles.push_back(i);
  network = std::make_unique<dem::NetworkOperator>(packing, overlap.bonds(), bonds, particles, active, overlap.de_weights());

  inverse_root_mass.resize(first_particle_dof + network->n_dofs());
  const Eigen::Matrix3Xd inverse_node_mass = fem.gather(fem::NodalField::inverse_mass);
  for (std::size_t p = 0; p < nodes.size(); ++p)
    for (int c = 0; c < dim; ++c)
      inverse_root_mass[dim * p + c] = std::sqrt(inverse_node_mass(c, nodes[p]));
  inverse_root_mass.tail(network->n_dofs()) = network->masses().cwiseSqrt().cwiseInverse();
  add_ties(fem, packing, overlap, tied);
  if (const std::vector<TieRow> rows = constraint.rows(fem, tied); !rows.empty())
    replace_rows(rows, tied);
  remove_masses_of_held(tied);
  restriction = constraint.projection(ties, inverse_root_mass);
}

/// Adds the weighted cells of all ranks with their centre in the part, and their nodes.
void CoupledOperator::add_cells(const fem::FemSide &fem, const Box &part, MPI_Comm comm)
{
  const fem::Mesh &mesh = fem.mesh();
  std::vector<int> of_rank;
  for (const int cell : fem.owned_cells())
    if (contains(part, cell_centre(mesh, cell)))
      of_rank.push_back(cell);
  std::vector<double> packed;
  const std::vector<fem::CellStiffness> stiffness = fem.cell_stiffness(of_rank);
  for (std::size_t k = 0; k < of_rank.size(); ++k)
    if ((stiffness[k].array() != 0.).any())
    {
      packed.push_back(of_rank[k]);
      packed.insert(packed.end(), stiffness[k].data(), stiffness[k].data() + stiffness[k].size());
    }
  packed = gather_all(packed, MPI_DOUBLE, comm);

  const int n_corners = static_cast<int>(mesh.cells.rows()), n = dim * n_corners;
  for (std::size_t k = 0; k < packed.size(); k += 1 + n * n)
  {
    Cell cell;
    const fem::CellMotion corners = fem::cell_motion(mesh, static_cast<int>(packed[k]));
    Eigen::MatrixXd motion = Eigen::MatrixXd::Zero(n, dim * corners.nodes.size()); // motion of the corners by that of the nodes
    for (std::size_t m = 0; m < corners.nodes.size(); ++m)
    {
      const auto entry = node_place.emplace(corners.nodes[m], static_cast<int>(nodes.size()));
      if (entry.second)
        nodes.push_back(corners.nodes[m]);
      cell.dof.push_back(dim * entry.first->second);
      for (int a = 0; a < n_corners; ++a)
        for (int c = 0; c < dim; ++c)
          motion(dim * a + c, dim * m + c) = corners.share(a, m);
    }
    cell.K = motion.transpose() * Eigen::Map<const Eigen::MatrixXd>(&packed[k + 1], n, n) * motion;
    cells.push_back(cell);
  }
}

void CoupledOperator::add_ties(const fem::FemSide &fem, const dem::Packing &packing, const Overlap &overlap,
                               const std::vector<TiedParticle> &tied)
{
  Eigen::Matrix3Xd points(3, tied.size());
  for (std::size_t k = 0; k < tied.size(); ++k)
    points.col(k) = packing.positions.col(tied[k].index);
  const std::vector<fem::Interpolation> found = fem.locate(points);
  std::unordered_map<int, double> shares; // sum over the tied particles of each node
  for (std::size_t k = 0; k < tied.size(); ++k)
    for (int a = 0; a < found[k].n; ++a)
      shares[found[k].nodes[a]] += tied[k].share * found[k].N[a];

  for (std::size_t k = 0; k < tied.size(); ++k)
  {
    const auto place = std::lower_bound(particles.begin(), particles.end(), tied[k].index);
    if (place == particles.end() || *place != tied[k].index)
      continue;
    OperatorTie tie;
    tie.particle = first_particle_dof + network->per_particle() * static_cast<int>(place - particles.begin());
    tie.share = tied[k].share;
    tie.weight = overlap.de_weights()[tied[k].index];
    tie.mass = 1. / std::pow(inverse_root_mass[tie.particle], 2);
    tie.measure = tie.share * packing.volume(tied[k].index);
    double inverse = 1. / tie.mass;
    bool whole = true;
    for (int a = 0; a < found[k].n; ++a)
    {
      if (found[k].N[a] <= 1e-12)
        continue;
      const auto node = node_place.find(found[k].nodes[a]);
      whole = whole && node != node_place.end();
      if (!whole)
        break;
      tie.node[tie.n] = dim * node->second;
      tie.N[tie.n++] = found[k].N[a];
      inverse +=
        found[k].N[a] * shares[found[k].nodes[a]] * std::pow(inverse_root_mass.segment(dim * node->second, dim).maxCoeff(), 2);
    }
    tie.mu = 1. / inverse;
    if (whole) // at the border of the part some nodes are missing
      ties.push_back(tie);
  }
}

/// Replaces the shape functions of the ties by the rows of the constraint, and their reduced masses.
void CoupledOperator::replace_rows(const std::vector<TieRow> &rows, const std::vector<TiedParticle> &tied)
{
  std::vector<OperatorTie> whole;
  for (const OperatorTie &known : ties)
  {
    const int index = particles[(known.particle - first_particle_dof) / network->per_particle()];
    const std::size_t k = std::lower_bound(tied.begin(), tied.end(), index,
                                           [](const TiedParticle &particle, int i) { return particle.index < i; }) -
                          tied.begin();
    OperatorTie tie = known;
    bool inside = rows[k].inverse_node_mass >= 0.;
    for (std::size_t b = 0; b < rows[k].node.size() && inside; ++b)
    {
      const auto node = node_place.find(rows[k].node[b]);
      inside = node != node_place.end();
      if (inside)
        tie.row.emplace_back(dim * node->second, rows[k].P[b]);
    }
    tie.mu = 1. / (1. / tie.mass + rows[k].inverse_node_mass);
    if (inside)
      whole.push_back(tie);
  }
  ties = std::move(whole);
}

template <int dim>
Eigen::Matrix<double, dim, 1> CoupledOperator::gap(const OperatorTie &tie, const Eigen::VectorXd &x) const
{
  Eigen::Matrix<double, dim, 1> chi = x.segment<dim>(tie.particle);
  for (const auto &[node, P] : tie.row)
    chi -= P.template topLeftCorner<dim, dim>() * x.segment<dim>(node);
  for (int a = 0; a < tie.n && tie.row.empty(); ++a)
    chi -= tie.N[a] * x.segment<dim>(tie.node[a]);
  return chi;
}

/// Adds coefficient times gap to the particles, and the transpose to the nodes, for all ties.
template <int dim>
void CoupledOperator::pull(const std::vector<double> &coefficients, const Eigen::VectorXd &x, Eigen::VectorXd &force) const
{
  for (std::size_t k = 0; k < ties.size(); ++k)
  {
    if (coefficients[k] == 0.)
      continue;
    const OperatorTie &tie = ties[k];
    const Eigen::Matrix<double, dim, 1> value = coefficients[k] * gap<dim>(tie, x);
    force.segment<dim>(tie.particle) += value;
    for (const auto &[node, P] : tie.row)
      force.segment<dim>(node) -= P.template topLeftCorner<dim, dim>().transpose() * value;
    for (int a = 0; a < tie.n && tie.row.empty(); ++a)
      force.segment<dim>(tie.node[a]) -= tie.N[a] * value;
  }
}

void CoupledOperator::remove_masses_of_held(const std::vector<TiedParticle> &tied)
{
  for (const TiedParticle &particle : tied)
    for (int axis = 0; axis < dim; ++axis)
      if (particle.blocked[axis])
      {
        const auto place = std::lower_bound(particles.begin(), particles.end(), particle.index);
        if (place != particles.end() && *place == particle.index)
          inverse_root_mass[first_particle_dof + network->per_particle() * (place - particles.begin()) + axis] = 0.;
      }
}

/// Adds (stiff K + viscous C) x of both sides to @p force.
void CoupledOperator::add_sides(double stiff, double viscous, const Eigen::VectorXd &x, Eigen::VectorXd &force) const
{
  Eigen::VectorXd local, cell_force;
  for (const Cell &cell : cells)
  {
    const int n = static_cast<int>(cell.dof.size());
    local.resize(dim * n);
    for (int a = 0; a < n; ++a)
      local.segment(dim * a, dim) = x.segment(cell.dof[a], dim);
    cell_force.noalias() = cell.K * local;
    for (int a = 0; a < n; ++a)
      force.segment(cell.dof[a], dim) += stiff * cell_force.segment(dim * a, dim);
  }
  network->add_sum(stiff, viscous, x.tail(network->n_dofs()), force.tail(network->n_dofs()));
}

/// Applies the operator, which is symmetric in y, the motion times the square root of the mass. The constraint must allow y.
void CoupledOperator::apply(double dt, const std::vector<double> &coefficients, const Eigen::VectorXd &y,
                            Eigen::VectorXd &result) const
{
  const Eigen::VectorXd x = inverse_root_mass.cwiseProduct(y);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(n_dofs());
  add_sides(dt * dt, 2. * dt, x, force);
  dim == 2 ? pull<2>(coefficients, x, force) : pull<3>(coefficients, x, force);
  result = inverse_root_mass.cwiseProduct(force);
  if (restriction)
    restriction->project(result);
}

Eigen::VectorXd CoupledOperator::start() const
{
  Eigen::VectorXd y = mode;
  if (y.size() != n_dofs())
  {
    y.resize(n_dofs());
    for (int i = 0; i < n_dofs(); ++i)
      y[i] = inverse_root_mass[i] > 0. ? scattered(i) : 0.;
  }
  if (restriction)
    restriction->project(y);
  return y;
}

double CoupledOperator::highest(double dt, double tolerance, int max_products)
{
  if (n_dofs() == 0)
    return 0.;
  std::vector<double> coefficients;
  for (const OperatorTie &tie : ties)
    coefficients.push_back(constraint.operator_coefficient(tie, dt));
  const HighestMode found = highest_mode([&](const Eigen::VectorXd &x, Eigen::VectorXd &y) { apply(dt, coefficients, x, y); },
                                         start(), tolerance, max_products);
  mode = found.vector;
  return found.value;
}

CoupledOperator::Quotient CoupledOperator::quotient(const Eigen::VectorXd &y) const
{
  Quotient result;
  const double length2 = y.squaredNorm();
  const Eigen::VectorXd x = inverse_root_mass.cwiseProduct(y);
  Eigen::VectorXd force = Eigen::VectorXd::Zero(n_dofs()), viscous_force = Eigen::VectorXd::Zero(n_dofs());
  add_sides(1., 0., x, force);
  add_sides(0., 2., x, viscous_force);
  result.square = x.dot(force) / length2;
  result.linear = x.dot(viscous_force) / length2;
  for (const OperatorTie &tie : ties)
    result.gap2.push_back((dim == 2 ? gap<2>(tie, x).squaredNorm() : gap<3>(tie, x).squaredNorm()) / length2);
  return result;
}

double CoupledOperator::value_of(const Quotient &quotient, double dt) const
{
  double value = quotient.square * dt * dt + quotient.linear * dt;
  for (std::size_t k = 0; k < ties.size(); ++k)
    value += constraint.operator_coefficient(ties[k], dt) * quotient.gap2[k];
  return value;
}

double CoupledOperator::stable_step(double guess, double limit)
{
  constexpr double farthest = 4.; // steps so far away have another mode
  double dt = guess;
  for (int iteration = 0; iteration < 10; ++iteration)
  {
    highest(dt, 1e-3, 400);
    const Quotient of_mode = quotient(mode);
    double lower = 0., upper = farthest * dt;
    for (int k = 0; k < 60; ++k)
      (value_of(of_mode, 0.5 * (lower + upper)) <= limit ? lower : upper) = 0.5 * (lower + upper);
    const bool settled = std::abs(lower - dt) < 1e-3 * dt;
    dt = lower;
    if (dt < 1e-9 * guess) // springs and damping that scale with the masses are above the limit at any step
      return 0.;
    if (settled)
      break;
  }
  return dt;
}

void CoupledOperator::take_mode(const CoupledOperator &before)
{
  if (before.mode.size() != before.n_dofs())
    return;
  mode.resize(n_dofs());
  for (int i = 0; i < n_dofs(); ++i)
    mode[i] = inverse_root_mass[i] > 0. ? 0.01 / std::sqrt(n_dofs()) * scattered(i) : 0.;
  for (std::size_t p = 0; p < before.nodes.size(); ++p)
    if (const auto found = node_place.find(before.nodes[p]); found != node_place.end())
      mode.segment(dim * found->second, dim) += before.mode.segment(dim * p, dim);
  const int dofs = network->per_particle();
  for (std::size_t p = 0; p < before.particles.size(); ++p)
  {
    const auto place = std::lower_bound(particles.begin(), particles.end(), before.particles[p]);
    if (place != particles.end() && *place == before.particles[p])
      mode.segment(first_particle_dof + dofs * (place - particles.begin()), dofs) +=
        before.mode.segment(before.first_particle_dof + dofs * p, dofs);
  }
}
} // namespace kerf
