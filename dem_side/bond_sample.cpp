// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_sample.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
using Strain = Eigen::Matrix2d;

/// The three strain cases in the order of Moduli::stiffness; engineering shear.
const std::array<Strain, 3> &strain_cases()
{
  static const std::array<Strain, 3> cases = {(Strain() << 1., 0., 0., 0.).finished(), (Strain() << 0., 0., 0., 1.).finished(),
                                              (Strain() << 0., 0.5, 0.5, 0.).finished()};
  return cases;
}

Eigen::Vector2d tangent(const Eigen::Vector2d &normal)
{
  return {-normal[1], normal[0]};
}

/// Rises from 0 to 1 with three continuous derivatives, so that sums over a lattice equal integrals to high order.
double smooth_step(double s)
{
  s = std::clamp(s, 0., 1.);
  return s * s * s * s * (35. + s * (-84. + s * (70. - 20. * s)));
}

void fit_isotropic(Moduli &moduli)
{
  // Orthogonal projection on the isotropic tensors: bulk modulus and mean of the shear modulus over all directions.
  const Eigen::Matrix3d &c = moduli.stiffness;
  const double bulk = (c(0, 0) + c(1, 1) + 2. * c(0, 1)) / 4.;
  const double shear = (c(0, 0) + c(1, 1) - 2. * c(0, 1) + 4. * c(2, 2)) / 8.;
  const double lambda = bulk - shear;
  Eigen::Matrix3d fit;
  fit << bulk + shear, lambda, 0., lambda, bulk + shear, 0., 0., 0., shear;
  moduli.young = shear * (3. * lambda + 2. * shear) / (lambda + shear);
  moduli.poisson = lambda / (2. * (lambda + shear));
  moduli.anisotropy = (c - fit).cwiseAbs().maxCoeff() / fit.cwiseAbs().maxCoeff();
}
} // namespace

BondSample::BondSample(const Packing &packing, int sample_size)
{
  if (packing.dim != 2)
    throw std::runtime_error("elastic moduli: only 2D packings can be solved so far");
  if (packing.size() == 0 || packing.bonds.empty())
    throw std::runtime_error("elastic moduli: the packing has no bonds");
  m_mean_diameter = 2. * packing.radii.mean();
  choose_window(packing, sample_size);
  collect(packing);
  assemble();
}

void BondSample::choose_window(const Packing &packing, int sample_size)
{
  const double share = std::min(1., std::sqrt(double(sample_size) / packing.size()));
  const Eigen::Vector2d middle = (packing.lower + packing.upper).head<2>() / 2.;
  const Eigen::Vector2d side = share * (packing.upper - packing.lower).head<2>();
  m_lower = middle - side / 2.;
  m_upper = middle + side / 2.;
  if (side.minCoeff() < 12. * m_mean_diameter)
  {
    std::ostringstream error;
    error << "elastic moduli: the sample is " << side.minCoeff() / m_mean_diameter
          << " mean diameters wide, at least 12 are needed";
    throw std::runtime_error(error.str());
  }
  for (int c = 0; c < 2; ++c)
  {
    const double inset = std::min(5. * m_mean_diameter, side[c] / 4.); // the skin disturbs about three diameters
    m_window_lower[c] = m_lower[c] + inset;
    m_window_upper[c] = m_upper[c] - inset;
    m_taper[c] = std::min(12. * m_mean_diameter, 0.45 * (side[c] - 2. * inset));
  }
}

double BondSample::window(const Eigen::Vector2d &x) const
{
  double value = 1.;
  for (int c = 0; c < 2; ++c)
    value *= smooth_step((x[c] - m_window_lower[c]) / m_taper[c]) * smooth_step((m_window_upper[c] - x[c]) / m_taper[c]);
  return value;
}

void BondSample::collect(const Packing &packing)
{
  std::vector<int> sample_index(packing.size(), -1);
  const double skin = 1.5 * m_mean_diameter;
  for (int i = 0; i < packing.size(); ++i)
  {
    const Eigen::Vector2d x = packing.positions.col(i).head<2>();
    const double inside = std::min((x - m_lower).minCoeff(), (m_upper - x).minCoeff());
    if (inside < 0.)
      continue;
    sample_index[i] = static_cast<int>(m_centres.size());
    m_centres.push_back(x);
    m_first_unknown.push_back(inside < skin ? -1 : m_unknowns);
    if (inside >= skin)
      m_unknowns += 3;
  }
  for (const auto &[a, b] : packing.bonds)
  {
    if (sample_index[a] < 0 || sample_index[b] < 0)
      continue;
    Bond bond;
    bond.i = sample_index[a];
    bond.j = sample_index[b];
    const Eigen::Vector2d x_i = m_centres[bond.i], x_j = m_centres[bond.j];
    bond.branch = x_j - x_i;
    const double length = bond.branch.norm();
    bond.normal = bond.branch / length;
    bond.lever_i = length * packing.radii[a] / (packing.radii[a] + packing.radii[b]);
    bond.lever_j = length - bond.lever_i;
    // Gauss integration of the window function along the branch.
    const double offset = std::sqrt(0.15);
    bond.weight = (8. * window(x_i + 0.5 * bond.branch) + 5. * window(x_i + (0.5 - offset) * bond.branch) +
                   5. * window(x_i + (0.5 + offset) * bond.branch)) /
                  18.;
    for (int k = 0; k < 3; ++k)
    {
      const Eigen::Vector2d relative = strain_cases()[k] * bond.branch;
      bond.stretch[k] = bond.normal.dot(relative);
      bond.shear[k] = tangent(bond.normal).dot(relative);
    }
    m_bonds.push_back(bond);
  }
}

void BondSample::assemble()
{
  std::vector<Eigen::Triplet<double>> normal, tangential;
  m_normal_load.setZero(m_unknowns, 3);
  m_tangential_load.setZero(m_unknowns, 3);
  const double scale = 2. / m_mean_diameter; // rotations are stored times the mean radius
  for (const Bond &bond : m_bonds)
  {
    const Eigen::Vector2d n = bond.normal, t = tangent(n);
    Eigen::Matrix<double, 6, 1> b_n, b_t;
    b_n << -n[0], -n[1], 0., n[0], n[1], 0.;
    b_t << -t[0], -t[1], -bond.lever_i * scale, t[0], t[1], -bond.lever_j * scale;
    const std::array<int, 2> first = {m_first_unknown[bond.i], m_first_unknown[bond.j]};
    for (int r = 0; r < 6; ++r)
    {
      if (first[r / 3] < 0)
        continue;
      const int row = first[r / 3] + r % 3;
      m_normal_load.row(row) -= b_n[r] * bond.stretch;
      m_tangential_load.row(row) -= b_t[r] * bond.shear;
      for (int c = 0; c < 6; ++c)
      {
        const int column = first[c / 3] + c % 3;
        if (first[c / 3] < 0 || column > row)
          continue;
        normal.emplace_back(row, column, b_n[r] * b_n[c]);
        tangential.emplace_back(row, column, b_t[r] * b_t[c]);
      }
    }
  }
  for (int d = 0; d < m_unknowns; ++d) // a particle without bonds still has its diagonal
  {
    normal.emplace_back(d, d, 0.);
    tangential.emplace_back(d, d, 0.);
  }
  m_normal.resize(m_unknowns, m_unknowns);
  m_tangential.resize(m_unknowns, m_unknowns);
  m_normal.setFromTriplets(normal.begin(), normal.end());
  m_tangential.setFromTriplets(tangential.begin(), tangential.end());
}

Moduli BondSample::relaxed(double k_n, double k_t)
{
  // One k_n scales everything, so solve with k_n = 1.
  const double kappa = k_t / k_n, weak_diagonal = 1e-10;
  Eigen::SparseMatrix<double> matrix = m_normal + kappa * m_tangential;
  matrix.diagonal().array() += weak_diagonal;
  if (!m_analysed)
    m_solver.analyzePattern(matrix);
  m_analysed = true;
  m_solver.factorize(matrix);
  if (m_solver.info() != Eigen::Success)
    throw std::runtime_error("elastic moduli: the stiffness matrix of the bonds cannot be factorised");
  const Eigen::MatrixX3d solution = m_solver.solve(m_normal_load + kappa * m_tangential_load);

  std::vector<Fluctuation> fluctuation(m_centres.size(), Fluctuation::Zero());
  for (std::size_t i = 0; i < m_centres.size(); ++i)
    if (m_first_unknown[i] >= 0)
      fluctuation[i] = solution.middleRows<3>(m_first_unknown[i]);
  return moduli(k_n, k_t, fluctuation);
}

Moduli BondSample::affine(double k_n, double k_t) const
{
  return moduli(k_n, k_t, std::vector<Fluctuation>(m_centres.size(), Fluctuation::Zero()));
}

Moduli BondSample::moduli(double k_n, double k_t, const std::vector<Fluctuation> &fluctuation) const
{
  // Strain: least-squares gradient of the displacement, weighted by the window.
  double weight_sum = 0.;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  std::vector<double> weights(m_centres.size());
  for (std::size_t i = 0; i < m_centres.size(); ++i)
  {
    weights[i] = window(m_centres[i]);
    weight_sum += weights[i];
    centre += weights[i] * m_centres[i];
  }
  centre /= weight_sum;
  Eigen::Matrix2d moment = Eigen::Matrix2d::Zero();
  std::array<Eigen::Matrix2d, 3> covariance = {Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero(), Eigen::Matrix2d::Zero()};
  for (std::size_t i = 0; i < m_centres.size(); ++i)
  {
    const Eigen::RowVector2d arm = (m_centres[i] - centre).transpose();
    moment += weights[i] * arm.transpose() * arm;
    for (int k = 0; k < 3; ++k)
      covariance[k] += weights[i] * fluctuation[i].col(k).head<2>() * arm;
  }
  Eigen::Matrix3d strain;
  for (int k = 0; k < 3; ++k)
  {
    const Eigen::Matrix2d gradient = strain_cases()[k] + covariance[k] * moment.inverse();
    strain.col(k) << gradient(0, 0), gradient(1, 1), gradient(0, 1) + gradient(1, 0);
  }

  // Stress: force times branch, each bond counted by the window function along it, over the integral of the window function.
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  const double scale = 2. / m_mean_diameter;
  for (const Bond &bond : m_bonds)
  {
    if (bond.weight == 0.)
      continue;
    const Eigen::Vector2d n = bond.normal, t = tangent(n), l = bond.branch;
    const Fluctuation &u_i = fluctuation[bond.i], &u_j = fluctuation[bond.j];
    const Eigen::Matrix<double, 2, 3> relative = u_j.topRows<2>() - u_i.topRows<2>();
    const Eigen::RowVector3d normal_force = k_n * (bond.stretch + n.transpose() * relative);
    const Eigen::RowVector3d rolling = scale * (bond.lever_i * u_i.row(2) + bond.lever_j * u_j.row(2));
    const Eigen::RowVector3d tangential_force = k_t * (bond.shear + t.transpose() * relative - rolling);
    const Eigen::Matrix<double, 2, 3> force = n * normal_force + t * tangential_force;
    stress.row(0) += bond.weight * force.row(0) * l[0];
    stress.row(1) += bond.weight * force.row(1) * l[1];
    stress.row(2) += bond.weight * 0.5 * (force.row(0) * l[1] + force.row(1) * l[0]);
  }
  // The smooth step is antisymmetric about its middle: each taper counts half.
  stress /= (m_window_upper - m_window_lower - m_taper).prod();

  Moduli result;
  const Eigen::Matrix3d stiffness = stress * strain.inverse();
  result.stiffness = (stiffness + stiffness.transpose()) / 2.;
  fit_isotropic(result);
  return result;
}
} // namespace kerf::dem
