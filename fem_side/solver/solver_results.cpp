// SPDX-License-Identifier: GPL-2.0-or-later
// Results that the solver computes on demand: stresses, stable step, output.
#include "fem_side/solver/explicit_solver.h"
#include "fem_side/solver/largest_eigenvalue.h"
#include "fem_side/solver/stress_recovery.h"
#include "fem_side/solver/vtu_output.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cstdint>
#include <limits>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
template <int dim>
void copy(const Eigen::Matrix<double, dim, dim> &from, double (&to)[dim][dim])
{
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j)
      to[i][j] = from(i, j);
}

Lanes determinant(const Lanes (&F)[2][2])
{
  return F[0][0] * F[1][1] - F[0][1] * F[1][0];
}
Lanes determinant(const Lanes (&F)[3][3])
{
  return F[0][0] * (F[1][1] * F[2][2] - F[1][2] * F[2][1]) - F[0][1] * (F[1][0] * F[2][2] - F[1][2] * F[2][0]) +
         F[0][2] * (F[1][0] * F[2][1] - F[1][1] * F[2][0]);
}

/// Cauchy stress F S F^T / det F from H = du/dX; order xx, yy, zz, yz, xz, xy. @p mean_dilatation: of the cells, if their
/// volumetric strain is the mean. With small strain all stresses are the same.
template <int dim, typename Law>
void cauchy_stress(const Law &law, const Lanes (&H)[dim][dim], const Lanes *mean_dilatation, Lanes (&stress)[6])
{
  Lanes E[dim][dim], S[dim][dim], sigma[dim][dim];
  Law::template strain<dim>(H, E);
  Lanes across = // lengths across the plane stay
    mean_dilatation ? law.template second_piola_of_mean<dim>(E, *mean_dilatation, S) : law.template second_piola<dim>(E, S);
  if constexpr (Law::linear)
    std::copy(&S[0][0], &S[0][0] + dim * dim, &sigma[0][0]);
  else
  {
    Lanes F[dim][dim], P[dim][dim];
    Law::template piola_of<dim>(H, S, P);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        F[i][j] = H[i][j] + (i == j ? 1. : 0.);
    const Lanes per_volume = 1. / determinant(F);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
      {
        sigma[i][j] = P[i][0] * F[j][0];
        for (int k = 1; k < dim; ++k)
          sigma[i][j] += P[i][k] * F[j][k];
        sigma[i][j] *= per_volume;
      }
    across *= per_volume;
  }
  constexpr int last = dim - 1;
  const Lanes none = {};
  stress[0] = sigma[0][0];
  stress[1] = sigma[1][1];
  stress[2] = dim == 2 ? across : sigma[last][last];
  stress[3] = dim == 2 ? none : sigma[1][last];
  stress[4] = dim == 2 ? none : sigma[0][last];
  stress[5] = sigma[0][1];
}

template <int dim, typename Law>
double mean_dilatation(const CellGeometry<dim> &cell, const q1::NodalValues<dim> &u)
{
  double sum = 0., H[dim][dim];
  for (int q = 0; q < q1::n_nodes<dim>; ++q)
  {
    copy<dim>(u * cell.gradients(q), H);
    sum += cell.weight[q] * Law::template dilatation<dim>(H);
  }
  return sum / cell.total_weight();
}

/// A fixed number in (-1, 1) for every component of every node, so that the answer does not depend on the ranks (splitmix64).
double start_value(const std::uint64_t index)
{
  std::uint64_t z = (index + 1) * 0x9e3779b97f4a7c15ull;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ull;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebull;
  z ^= z >> 31;
  return static_cast<double>(z >> 11) * 0x1p-52 - 1.;
}
} // namespace

template <int dim>
CellStress ExplicitSolver<dim>::cell_stress() const
{
  const double lambda = settings.material.lame_lambda(), mu = settings.material.lame_mu();
  if (settings.strain == Strain::finite)
    return stress_of(StVenantKirchhoff(lambda, mu));
  return stress_of(LinearisedLaw(lambda, mu));
}

template <int dim>
template <typename Law>
CellStress ExplicitSolver<dim>::stress_of(const Law &law) const
{
  NodalVector &u = with_copies;
  u = displacement;
  space.update_copies(u);
  CellStress result;
  result.sigma.resize(6, kernel.n_cells());
  const int n_cells = static_cast<int>(space.owned_cells.size());
  for (int first = 0; first < n_cells; first += n_lanes)
  {
    const CentreBatch &batch = centres[first / n_lanes];
    Lanes H[dim][dim] = {}, mean = {}, sigma[6];
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < dim; ++i)
      {
        Lanes value;
        for (int lane = 0; lane < n_lanes; ++lane)
          value[lane] = u.data()[batch.dof[a][lane] + i];
        for (int j = 0; j < dim; ++j)
          H[i][j] += value * batch.gradient[a][j];
      }
    const int n_here = std::min(n_lanes, n_cells - first);
    const bool selective = settings.integration == Integration::selective;
    for (int lane = 0; lane < n_here && selective; ++lane)
      if (is_active(first + lane))
      {
        q1::NodalValues<dim> values;
        for (int a = 0; a < n; ++a)
          values.col(a) = Eigen::Map<const q1::Point<dim>>(u.data() + batch.dof[a][lane]);
        const CellGeometry<dim> cell(space.cell_nodes(space.owned_cells[first + lane]), weights_of(first + lane));
        mean[lane] = mean_dilatation<dim, Law>(cell, values);
      }
    cauchy_stress<dim>(law, H, selective ? &mean : nullptr, sigma);
    for (int lane = 0; lane < n_here; ++lane)
      if (is_active(first + lane))
      {
        for (int k = 0; k < 6; ++k)
          result.sigma(k, result.cell.size()) = sigma[k][lane];
        result.cell.push_back(space.owned_cells[first + lane]);
      }
  }
  return result;
}

template <int dim>
std::vector<CellStiffness> ExplicitSolver<dim>::cell_stiffness(const std::vector<int> &cells) const
{
  // Every cell gets nodes of its own, so that one unit displacement in each of them gives a column of every matrix.
  constexpr int n_dofs = dim * n;
  CellKernel<dim> separate(settings.material, settings.strain, settings.integration);
  std::array<double, n> cell_alpha;
  for (std::size_t k = 0; k < cells.size(); ++k)
  {
    const auto owned = std::find(space.owned_cells.begin(), space.owned_cells.end(), cells[k]);
    if (owned == space.owned_cells.end())
      throw std::logic_error("cell_stiffness: this rank does not own cell " + std::to_string(cells[k]));
    std::array<int, n> first_dofs;
    for (int q = 0; q < n; ++q)
    {
      first_dofs[q] = static_cast<int>(k) * n_dofs + dim * q;
      cell_alpha[q] = alpha[n * (owned - space.owned_cells.begin()) + q];
    }
    separate.add_cell(first_dofs, space.cell_nodes(cells[k]), cell_alpha);
  }
  std::vector<CellStiffness> matrices(cells.size(), CellStiffness::Zero(n_dofs, n_dofs));
  Eigen::MatrixXd u(n_dofs, cells.size()), f(n_dofs, cells.size());
  for (int column = 0; column < n_dofs; ++column)
  {
    u.setZero();
    u.row(column).setOnes();
    f.setZero();
    separate.subtract_linear_forces(u.data(), f.data());
    for (std::size_t k = 0; k < cells.size(); ++k)
      matrices[k].col(column) = -f.col(k);
  }
  return matrices;
}

template <int dim>
double ExplicitSolver<dim>::stable_step() const
{
  const int n_dofs = space.n_owned_dofs();
  const Eigen::VectorXd scale = Eigen::Map<const Eigen::VectorXd>(inverse_mass.data(), n_dofs).cwiseSqrt();
  NodalVector u = space.zero_vector(), f = u;
  const auto apply = [&](const Eigen::VectorXd &x, Eigen::VectorXd &y)
  {
    for (int i = 0; i < n_dofs; ++i)
      u[i] = scale[i] * x[i];
    space.update_copies(u);
    f.setZero();
    kernel.subtract_linear_forces(u.data(), f.data());
    space.sum_up(f);
    for (int i = 0; i < n_dofs; ++i)
      y[i] = -scale[i] * f[i];
  };
  Eigen::VectorXd start(n_dofs);
  for (int i = 0; i < n_dofs; ++i)
    start[i] = scale[i] > 0. ? start_value(std::uint64_t(dim) * space.owned_nodes[i / dim] + i % dim) : 0.;

  const LargestEigenvalue omega_squared = largest_eigenvalue(apply, start, space.comm, 1e-3, 500);
  if (!(omega_squared.value > 0.))
    return std::numeric_limits<double>::infinity();
  return 2. / std::sqrt(omega_squared.value + omega_squared.error);
}

template <int dim>
void ExplicitSolver<dim>::write_vtu(const std::string &path,
                                    const std::vector<std::pair<std::string, Eigen::VectorXd>> &cell_fields) const
{
  NodalVector u = displacement, v = velocity;
  space.update_copies(u);
  space.update_copies(v);
  const int n_cells = space.mesh.n_cells();
  VtuContent content{u, v, std::vector<bool>(n_cells, false), {}, {}};

  Eigen::VectorXd mean_alpha = Eigen::VectorXd::Zero(n_cells);
  for (std::size_t c = 0; c < space.owned_cells.size(); ++c)
    mean_alpha[space.owned_cells[c]] = alpha.template segment<n>(n * c).mean();
  content.cell_data.emplace_back("alpha", mean_alpha);

  const CellStress stress = cell_stress();
  const std::array<const char *, 6> names = {{"xx", "yy", "zz", "yz", "xz", "xy"}};
  for (int k = 0; k < 6; ++k)
  {
    if (dim == 2 && (k == 3 || k == 4))
      continue;
    Eigen::VectorXd component = Eigen::VectorXd::Zero(n_cells);
    for (std::size_t i = 0; i < stress.cell.size(); ++i)
      component[stress.cell[i]] = stress.sigma(k, i);
    content.cell_data.emplace_back(std::string("stress_") + names[k], component);
  }
  for (const int cell : stress.cell)
    content.written[cell] = true;
  content.smooth_stress = recover_stress(space.mesh, stress, space.comm);

  for (const auto &[name, values] : cell_fields)
  {
    if (values.size() != n_cells)
      throw std::logic_error("write_vtu: cell field '" + name + "': not as many values as mesh cells");
    content.cell_data.emplace_back(name, values);
  }
  write_vtu_file<dim>(space, path, content);
}

template CellStress ExplicitSolver<2>::cell_stress() const;
template CellStress ExplicitSolver<3>::cell_stress() const;
template std::vector<CellStiffness> ExplicitSolver<2>::cell_stiffness(const std::vector<int> &) const;
template std::vector<CellStiffness> ExplicitSolver<3>::cell_stiffness(const std::vector<int> &) const;
template double ExplicitSolver<2>::stable_step() const;
template double ExplicitSolver<3>::stable_step() const;
template void ExplicitSolver<2>::write_vtu(const std::string &,
                                           const std::vector<std::pair<std::string, Eigen::VectorXd>> &) const;
template void ExplicitSolver<3>::write_vtu(const std::string &,
                                           const std::vector<std::pair<std::string, Eigen::VectorXd>> &) const;
} // namespace kerf::fem
