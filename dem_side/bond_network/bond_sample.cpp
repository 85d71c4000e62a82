// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/bond_sample.h"

#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/packing/laguerre.h"
#include "dem_side/packing/solid_region.h"

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
/// Rises from 0 to 1 with three continuous derivatives. A window with such edges averages a repeating pattern over whole cells.
double smooth_step(double s)
{
  s = std::clamp(s, 0., 1.);
  return s * s * s * s * (35. + s * (-84. + s * (70. - 20. * s)));
}

/// Row and column of each component of a symmetric tensor.
template <int dim>
constexpr std::array<std::array<int, 2>, dim *(dim + 1) / 2> places()
{
  if constexpr (dim == 2)
    return {{{0, 0}, {1, 1}, {0, 1}}};
  else
    return {{{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}}};
}

/// Orthogonal projection of the stiffness on the isotropic tensors: mean bulk and shear modulus over all directions.
template <int dim>
void fit_isotropic(Moduli &moduli)
{
  const Eigen::MatrixXd &c = moduli.stiffness;
  const int n_shears = static_cast<int>(c.rows()) - dim;
  const double normal = c.topLeftCorner<dim, dim>().sum(), diagonal = c.topLeftCorner<dim, dim>().trace();
  const double coupling = (normal - diagonal) / 2., shears = c.bottomRightCorner(n_shears, n_shears).trace();
  const double bulk = normal / (dim * dim);
  const double shear = dim == 2 ? (diagonal - 2. * coupling + 4. * shears) / 8. : (diagonal - coupling + 3. * shears) / 15.;
  const double lambda = bulk - 2. / dim * shear;
  Eigen::MatrixXd fit = Eigen::MatrixXd::Zero(c.rows(), c.cols());
  fit.topLeftCorner<dim, dim>().setConstant(lambda);
  fit.topLeftCorner<dim, dim>().diagonal().array() += 2. * shear;
  fit.bottomRightCorner(n_shears, n_shears).diagonal().setConstant(shear);
  moduli.young = shear * (3. * lambda + 2. * shear) / (lambda + shear);
  moduli.poisson = lambda / (2. * (lambda + shear));
  moduli.anisotropy = (c - fit).cwiseAbs().maxCoeff() / fit.cwiseAbs().maxCoeff();
}

template <int dim>
void find_axis_moduli(Moduli &moduli)
{
  const Eigen::MatrixXd compliance = moduli.stiffness.inverse();
  for (int c = 0; c < dim; ++c)
  {
    const double own = compliance(c, c);
    const double ratio = -(compliance.row(c).head(dim).sum() - own) / (dim - 1) / own;
    // Plane strain: own = (1 - nu^2) / E and ratio = nu / (1 - nu).
    const double nu = dim == 2 ? ratio / (1. + ratio) : ratio;
    moduli.axis_poisson[c] = nu;
    moduli.axis_young[c] = (dim == 2 ? 1. - nu * nu : 1.) / own;
  }
}
} // namespace

/// Unit strains in the order of Moduli::stiffness; engineering shear.
template <int dim>
const std::array<typename BondSampleOf<dim>::Tensor, BondSampleOf<dim>::n_strains> &BondSampleOf<dim>::strain_cases()
{
  static const std::array<Tensor, n_strains> cases = []
  {
    std::array<Tensor, n_strains> result;
    for (int k = 0; k < n_strains; ++k)
    {
      const auto [r, c] = places<dim>()[k];
      result[k].setZero();
      result[k](r, c) += 0.5;
      result[k](c, r) += 0.5;
    }
    return result;
  }();
  return cases;
}

template <int dim>
typename BondSampleOf<dim>::Components BondSampleOf<dim>::components(const Tensor &tensor)
{
  Components result;
  for (int k = 0; k < n_strains; ++k)
  {
    const auto [r, c] = places<dim>()[k];
    result[k] = (tensor(r, c) + tensor(c, r)) / 2.;
  }
  return result;
}

template <int dim>
BondSampleOf<dim>::BondSampleOf(const Packing &packing, int sample_size)
{
  if (packing.size() == 0 || packing.bonds.empty())
    throw std::invalid_argument("elastic moduli: the packing has no bonds");
  m_mean_diameter = 2. * packing.radii.mean();
  for (int c = 0; c < dim; ++c)
    m_periodic[c] = packing.periodic[c] > 0.;
  choose_window(packing, sample_size);
  collect(packing);
}

template <int dim>
void BondSampleOf<dim>::choose_window(const Packing &packing, int sample_size)
{
  const auto [lower, upper] = filled_box(packing);
  const double box = (upper - lower).template head<dim>().prod();
  const double particles = packing.size() * (packing.volume_filled > 0. ? std::min(1., box / packing.volume_filled) : 1.);
  const int n_cut = dim - static_cast<int>(std::count(m_periodic.begin(), m_periodic.end(), true));
  const double share = n_cut > 0 ? std::min(1., std::pow(sample_size / particles, 1. / n_cut)) : 1.;
  const Vector middle = (lower + upper).template head<dim>() / 2.;
  Vector side = (upper - lower).template head<dim>();
  for (int c = 0; c < dim; ++c)
    if (!m_periodic[c])
    {
      side[c] *= share;
      if (!(side[c] >= 12. * m_mean_diameter))
      {
        std::ostringstream error;
        error << "elastic moduli: the sample is " << side[c] / m_mean_diameter
              << " mean diameters wide, at least 12 are needed";
        throw std::invalid_argument(error.str());
      }
    }
  m_lower = middle - side / 2.;
  m_upper = middle + side / 2.;
  // The skin disturbs the stresses over about three diameters. Every taper is exact for a lattice, because each particle has
  // its own cell. A longer taper averages over whole periods of a pattern, a shorter one over more particles.
  for (int c = 0; c < dim; ++c)
  {
    const double inset = std::min(std::clamp(0.1 * side[c], 3. * m_mean_diameter, 5. * m_mean_diameter), side[c] / 4.);
    m_window_lower[c] = m_lower[c] + inset;
    m_window_upper[c] = m_upper[c] - inset;
    const double inner = side[c] - 2. * inset;
    m_taper[c] = dim == 2 ? std::min(12. * m_mean_diameter, 0.27 * inner) : std::min(3. * m_mean_diameter, 0.45 * inner);
  }
}

template <int dim>
double BondSampleOf<dim>::window(const Vector &x) const
{
  double value = 1.;
  for (int c = 0; c < dim; ++c)
    if (!m_periodic[c])
      value *= smooth_step((x[c] - m_window_lower[c]) / m_taper[c]) * smooth_step((m_window_upper[c] - x[c]) / m_taper[c]);
  return value;
}

template <int dim>
void BondSampleOf<dim>::collect(const Packing &packing)
{
  std::vector<int> sample_index(packing.size(), -1);
  std::vector<char> counts(packing.size(), 0);
  const double skin = 1.5 * m_mean_diameter;
  for (int i = 0; i < packing.size(); ++i)
  {
    const Vector x = packing.positions.col(i).template head<dim>();
    double inside = std::numeric_limits<double>::infinity();
    for (int c = 0; c < dim; ++c)
      if (!m_periodic[c])
        inside = std::min({inside, x[c] - m_lower[c], m_upper[c] - x[c]});
    if (inside < 0.)
      continue;
    sample_index[i] = static_cast<int>(m_centres.size());
    m_centres.push_back(x);
    m_weights.push_back(window(x));
    counts[i] = m_weights.back() > 0.;
    m_first_unknown.push_back(inside < skin ? -1 : m_unknowns);
    if (inside >= skin)
      m_unknowns += dofs;
  }
  const Eigen::VectorXd volumes = laguerre_volumes(packing, counts);
  for (int i = 0; i < packing.size(); ++i)
    if (sample_index[i] >= 0)
      m_volumes.push_back(volumes[i]);
  for (const auto &[a, b] : packing.bonds)
  {
    if (sample_index[a] < 0 || sample_index[b] < 0)
      continue;
    Bond bond;
    bond.i = sample_index[a];
    bond.j = sample_index[b];
    const Vector branch = packing.branch(a, b).template head<dim>();
    const double length = branch.norm();
    bond.normal = branch / length;
    bond.lever_i = length * packing.radii[a] / (packing.radii[a] + packing.radii[b]);
    bond.lever_j = length - bond.lever_i;
    m_bonds.push_back(bond);
  }
}

template <int dim>
typename BondSampleOf<dim>::Kinematics BondSampleOf<dim>::kinematics(const Bond &bond) const
{
  Eigen::Matrix<double, dim, 2 *dofs> matrix = relative_displacement<dim>(bond.normal, bond.lever_i, bond.lever_j);
  // Rotations are stored times the mean radius.
  matrix.template middleCols<dofs - dim>(dim) *= 2. / m_mean_diameter;
  matrix.template rightCols<dofs - dim>() *= 2. / m_mean_diameter;
  return matrix;
}

template <int dim>
typename BondSampleOf<dim>::Jump BondSampleOf<dim>::uniform_jump(const Bond &bond) const
{
  Jump jump;
  for (int k = 0; k < n_strains; ++k)
    jump.col(k) = strain_cases()[k] * ((bond.lever_i + bond.lever_j) * bond.normal);
  return jump;
}

template <int dim>
void BondSampleOf<dim>::assemble()
{
  std::vector<Eigen::Triplet<double>> normal, tangential;
  normal.reserve(m_bonds.size() * dofs * (2 * dofs + 1) + m_unknowns);
  tangential.reserve(normal.capacity());
  m_normal_load.setZero(m_unknowns, n_strains);
  m_tangential_load.setZero(m_unknowns, n_strains);
  for (const Bond &bond : m_bonds)
  {
    const Tensor along = bond.normal * bond.normal.transpose(), across = Tensor::Identity() - along;
    const Eigen::Matrix<double, dim, 2 *dofs> b = kinematics(bond);
    const Eigen::Matrix<double, 2 * dofs, 2 *dofs> k_n = b.transpose() * along * b, k_t = b.transpose() * across * b;
    const Jump jump = uniform_jump(bond);
    const Eigen::Matrix<double, 2 * dofs, n_strains> load_n = b.transpose() * along * jump,
                                                     load_t = b.transpose() * across * jump;
    const std::array<int, 2> first = {m_first_unknown[bond.i], m_first_unknown[bond.j]};
    for (int r = 0; r < 2 * dofs; ++r)
    {
      if (first[r / dofs] < 0)
        continue;
      const int row = first[r / dofs] + r % dofs;
      m_normal_load.row(row) -= load_n.row(r);
      m_tangential_load.row(row) -= load_t.row(r);
      for (int c = 0; c < 2 * dofs; ++c)
      {
        const int column = first[c / dofs] + c % dofs;
        if (first[c / dofs] < 0 || column > row)
          continue;
        normal.emplace_back(row, column, k_n(r, c));
        tangential.emplace_back(row, column, k_t(r, c));
      }
    }
  }
  for (int d = 0; d < m_unknowns; ++d) // a particle without bonds needs its diagonal, too
  {
    normal.emplace_back(d, d, 0.);
    tangential.emplace_back(d, d, 0.);
  }
  m_normal.resize(m_unknowns, m_unknowns);
  m_tangential.resize(m_unknowns, m_unknowns);
  m_normal.setFromTriplets(normal.begin(), normal.end());
  m_tangential.setFromTriplets(tangential.begin(), tangential.end());
}

template <int dim>
typename BondSampleOf<dim>::Columns BondSampleOf<dim>::solve(double ratio)
{
  const bool is_first = m_normal.rows() == 0;
  if (is_first)
    assemble();
  const double weak_diagonal = 1e-10;
  Eigen::SparseMatrix<double> matrix = m_normal + ratio * m_tangential;
  matrix.diagonal().array() += weak_diagonal;
  const Columns load = m_normal_load + ratio * m_tangential_load;
  if constexpr (dim == 2)
  {
    if (is_first)
      m_cholesky.analyzePattern(matrix);
    m_cholesky.factorize(matrix);
    if (m_cholesky.info() != Eigen::Success)
      throw std::runtime_error("elastic moduli: the stiffness matrix of the bonds cannot be factorised");
    return m_cholesky.solve(load);
  }
  else
  {
    // In 3D fill-in makes a factorisation many times more expensive.
    Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower, Eigen::IncompleteCholesky<double>> solver;
    solver.setTolerance(1e-9); // the error of the energy, hence of the moduli, is its square
    solver.setMaxIterations(5000);
    solver.compute(matrix);
    if (solver.info() != Eigen::Success)
      throw std::runtime_error("elastic moduli: the stiffness matrix of the bonds cannot be preconditioned");
    if (m_last_solution.rows() == 0)
      m_last_solution.setZero(m_unknowns, n_strains);
    for (int k = 0; k < n_strains; ++k)
    {
      // The load of a lattice is round-off, for which no iteration reaches a relative tolerance.
      if (load.col(k).norm() <= 1e-12 * m_mean_diameter * std::sqrt(double(m_unknowns)))
        m_last_solution.col(k).setZero();
      else
        m_last_solution.col(k) = solver.solveWithGuess(load.col(k), m_last_solution.col(k)).eval();
      if (solver.info() != Eigen::Success)
        throw std::runtime_error("elastic moduli: the static solve of the bonds does not converge");
    }
    return m_last_solution;
  }
}

template <int dim>
Moduli BondSampleOf<dim>::relaxed(double k_n, double k_t)
{
  // The solution depends on k_t / k_n only, so solve with k_n = 1.
  const Columns solution = solve(k_t / k_n);
  std::vector<Fluctuation> fluctuation(m_centres.size(), Fluctuation::Zero());
  for (std::size_t i = 0; i < m_centres.size(); ++i)
    if (m_first_unknown[i] >= 0)
      fluctuation[i] = solution.template middleRows<dofs>(m_first_unknown[i]);
  return moduli(k_n, k_t, fluctuation);
}

template <int dim>
Moduli BondSampleOf<dim>::affine(double k_n, double k_t) const
{
  return moduli(k_n, k_t, std::vector<Fluctuation>(m_centres.size(), Fluctuation::Zero()));
}

template <int dim>
Moduli BondSampleOf<dim>::moduli(double k_n, double k_t, const std::vector<Fluctuation> &fluctuation) const
{
  // Strain: least-squares gradient of the displacement, weighted by the window.
  double weight_sum = 0., volume = 0.;
  Vector centre = Vector::Zero();
  for (std::size_t i = 0; i < m_centres.size(); ++i)
  {
    weight_sum += m_weights[i];
    volume += m_weights[i] * m_volumes[i];
    centre += m_weights[i] * m_centres[i];
  }
  centre /= weight_sum;
  Tensor moment = Tensor::Zero();
  std::array<Tensor, n_strains> covariance;
  covariance.fill(Tensor::Zero());
  for (std::size_t i = 0; i < m_centres.size(); ++i)
  {
    Eigen::Matrix<double, 1, dim> arm = (m_centres[i] - centre).transpose();
    for (int c = 0; c < dim; ++c)
      arm[c] *= !m_periodic[c]; // fluctuations repeat themselves there: no mean gradient
    moment += m_weights[i] * arm.transpose() * arm;
    for (int k = 0; k < n_strains; ++k)
      covariance[k] += m_weights[i] * fluctuation[i].col(k).template head<dim>() * arm;
  }
  for (int c = 0; c < dim; ++c)
    if (m_periodic[c])
      moment(c, c) = 1.; // any nonzero number, because the covariance is zero
  Eigen::Matrix<double, n_strains, n_strains> strain, stress;
  for (int k = 0; k < n_strains; ++k)
  {
    strain.col(k) = components(strain_cases()[k] + covariance[k] * moment.inverse());
    strain.col(k).template tail<n_strains - dim>() *= 2.;
  }

  // Stress: force times arm of the contacts of each particle, over the volume of its cell.
  std::array<Tensor, n_strains> virial;
  virial.fill(Tensor::Zero());
  for (const Bond &bond : m_bonds)
  {
    const double weight = m_weights[bond.i] * bond.lever_i + m_weights[bond.j] * bond.lever_j;
    if (weight == 0.)
      continue;
    Eigen::Matrix<double, 2 * dofs, n_strains> q;
    q << fluctuation[bond.i], fluctuation[bond.j];
    const Jump jump = uniform_jump(bond) + kinematics(bond) * q;
    const Jump force = k_t * jump + (k_n - k_t) * bond.normal * (bond.normal.transpose() * jump);
    for (int k = 0; k < n_strains; ++k)
      virial[k] += weight * force.col(k) * bond.normal.transpose();
  }
  for (int k = 0; k < n_strains; ++k)
    stress.col(k) = components(virial[k] / volume);

  Moduli result;
  const Eigen::Matrix<double, n_strains, n_strains> stiffness = stress * strain.inverse();
  result.stiffness = (stiffness + stiffness.transpose()) / 2.;
  fit_isotropic<dim>(result);
  find_axis_moduli<dim>(result);
  return result;
}

template class BondSampleOf<2>;
template class BondSampleOf<3>;

std::unique_ptr<BondSample> make_bond_sample(const Packing &packing, int sample_size)
{
  if (packing.dim == 2)
    return std::make_unique<BondSampleOf<2>>(packing, sample_size);
  if (packing.dim == 3)
    return std::make_unique<BondSampleOf<3>>(packing, sample_size);
  throw std::invalid_argument("elastic moduli: the packing must be 2D or 3D");
}
} // namespace kerf::dem
