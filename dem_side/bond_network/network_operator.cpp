// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/bond_network/network_operator.h"

#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/bond/bond_weight.h"
#include "dem_side/bond/rock_bond_law.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace kerf::dem
{
NetworkOperator::NetworkOperator(const Packing &packing, const StoredBonds &stored_bonds, const Material &material,
                                 const std::vector<int> &particles, const std::vector<char> &active,
                                 const Eigen::VectorXd &weight)
  : dim(packing.dim), inertia(particles.size() * (packing.dim == 2 ? 3 : 6))
{
  if (!std::is_sorted(particles.begin(), particles.end()))
    throw std::logic_error("network operator: particles must be in ascending order");
  const int dofs = per_particle();
  for (int p = 0; p < static_cast<int>(particles.size()); ++p)
  {
    const int i = particles[p];
    const BondEnd first = bond_end(packing.radii[i], weight[i]);
    for (const int j : stored_bonds.partners_of(i))
    {
      const auto other = std::lower_bound(particles.begin() + p, particles.end(), j);
      if (!active[j] || j < i || other == particles.end() || *other != j)
        continue;
      const BondEnd second = bond_end(packing.radii[j], weight[j]);
      const double of_bond = bond_weight(first, second);
      const Eigen::Vector3d branch = packing.shortest(packing.positions.col(j) - packing.positions.col(i));
      const double length = branch.norm(), lever = length * first.weighted / (first.weighted + second.weighted);
      bonds.push_back({dofs * p, dofs * static_cast<int>(other - particles.begin()), branch / length, lever, length - lever,
                       of_bond * material.k_n, of_bond * material.k_t,
                       rolling_resistance(first, second) * material.k_t * length * length, 0., 0.});
    }
    const double mass = material.density * packing.volume(i) * mass_weight(i, packing, stored_bonds, active, weight);
    inertia.segment(dofs * p, dim).setConstant(mass);
    inertia.segment(dofs * p + dim, dofs - dim).setConstant(inertia_factor(dim) * mass * packing.radii[i] * packing.radii[i]);
  }
  for (Bond &bond : bonds)
  {
    bond.normal_c = law::viscosity(material.damping, inertia[bond.first], inertia[bond.second], bond.normal_k);
    bond.shear_c = bond.normal_c * std::sqrt(material.k_n > 0. ? material.k_t / material.k_n : 0.);
  }
}

namespace
{
using Vector1d = Eigen::Matrix<double, 1, 1>;

Eigen::Vector3d cross(const Eigen::Vector3d &turn, const Eigen::Vector3d &arm)
{
  return turn.cross(arm);
}
Eigen::Vector2d cross(const Vector1d &turn, const Eigen::Vector2d &arm)
{
  return turn[0] * Eigen::Vector2d(-arm[1], arm[0]);
}
Eigen::Vector3d moment_of(const Eigen::Vector3d &arm, const Eigen::Vector3d &force)
{
  return arm.cross(force);
}
Vector1d moment_of(const Eigen::Vector2d &arm, const Eigen::Vector2d &force)
{
  return Vector1d(arm[0] * force[1] - arm[1] * force[0]);
}
/// The part of a rotation vector that tilts @p normal.
Eigen::Vector3d across(const Eigen::Vector3d &normal, const Eigen::Vector3d &turn)
{
  return turn - normal.dot(turn) * normal;
}
Vector1d across(const Eigen::Vector2d & /*normal*/, const Vector1d &turn)
{
  return turn;
}
} // namespace

template <int dim>
void NetworkOperator::add_sum_in(double stiff, double viscous, const Eigen::Ref<const Eigen::VectorXd> &x,
                                 Eigen::Ref<Eigen::VectorXd> y) const
{
  for (const Bond &bond : bonds)
  {
    using Vector = Eigen::Matrix<double, dim, 1>;
    using Spin = Eigen::Matrix<double, rotations<dim>, 1>;
    // relative_displacement() times x, written out because searches for the highest mode spend most of their time here.
    const Vector n = bond.normal.head<dim>();
    const Spin turn =
      bond.lever * x.segment<rotations<dim>>(bond.first + dim) + bond.reach * x.segment<rotations<dim>>(bond.second + dim);
    const Vector opening = x.segment<dim>(bond.second) - x.segment<dim>(bond.first) - cross(turn, n);
    const double normal_factor = stiff * bond.normal_k + viscous * bond.normal_c;
    const double shear_factor = stiff * bond.shear_k + viscous * bond.shear_c;
    const Vector force = shear_factor * opening + (normal_factor - shear_factor) * n.dot(opening) * n;
    const Spin moment = moment_of(n, force);
    const Spin rolling =
      stiff * bond.rolling_k *
      across(n, Spin(x.segment<rotations<dim>>(bond.second + dim) - x.segment<rotations<dim>>(bond.first + dim)));
    y.segment<dim>(bond.first) -= force;
    y.segment<dim>(bond.second) += force;
    y.segment<rotations<dim>>(bond.first + dim) -= bond.lever * moment + rolling;
    y.segment<rotations<dim>>(bond.second + dim) -= bond.reach * moment - rolling;
  }
}

void NetworkOperator::add_sum(double stiff, double viscous, const Eigen::Ref<const Eigen::VectorXd> &x,
                              Eigen::Ref<Eigen::VectorXd> y) const
{
  if (dim == 2)
    add_sum_in<2>(stiff, viscous, x, y);
  else
    add_sum_in<3>(stiff, viscous, x, y);
  for (int p = 0; p < dashpots.size(); ++p)
    y.segment(per_particle() * p, dim) += viscous * dashpots[p] * x.segment(per_particle() * p, dim);
}

template <int dim>
void NetworkOperator::add_homogeneous_in(const Eigen::Matrix3d &strain, Eigen::Ref<Eigen::VectorXd> y) const
{
  constexpr int dofs = particle_dofs<dim>;
  for (const Bond &bond : bonds)
  {
    const Eigen::Matrix<double, dim, 1> n = bond.normal.head<dim>();
    const auto relative = relative_displacement<dim>(n, bond.lever, bond.reach);
    const Eigen::Matrix<double, dim, 1> opening = (bond.lever + bond.reach) * (strain.template topLeftCorner<dim, dim>() * n);
    const Eigen::Matrix<double, dim, 1> force = bond.shear_k * opening + (bond.normal_k - bond.shear_k) * n.dot(opening) * n;
    y.segment<dofs>(bond.first) += relative.template leftCols<dofs>().transpose() * force;
    y.segment<dofs>(bond.second) += relative.template rightCols<dofs>().transpose() * force;
  }
}

void NetworkOperator::add_homogeneous(const Eigen::Matrix3d &strain, Eigen::Ref<Eigen::VectorXd> y) const
{
  if (dim == 2)
    add_homogeneous_in<2>(strain, y);
  else
    add_homogeneous_in<3>(strain, y);
}

template <int dim>
Eigen::VectorXd NetworkOperator::diagonal_in() const
{
  constexpr int dofs = particle_dofs<dim>;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n_dofs());
  for (const Bond &bond : bonds)
  {
    const Eigen::Matrix<double, dim, 1> n = bond.normal.head<dim>();
    const auto relative = relative_displacement<dim>(n, bond.lever, bond.reach);
    for (int k = 0; k < 2 * dofs; ++k)
    {
      const double normal = n.dot(relative.col(k));
      result[k < dofs ? bond.first + k : bond.second + k - dofs] +=
        bond.shear_k * relative.col(k).squaredNorm() + (bond.normal_k - bond.shear_k) * normal * normal;
    }
    for (int axis = 0; axis < rotations<dim>; ++axis)
    {
      using Spin = Eigen::Matrix<double, rotations<dim>, 1>;
      const double tilt = across(n, Spin(Spin::Unit(axis)))[axis];
      result[bond.first + dim + axis] += bond.rolling_k * tilt;
      result[bond.second + dim + axis] += bond.rolling_k * tilt;
    }
  }
  return result;
}

Eigen::VectorXd NetworkOperator::diagonal() const
{
  return dim == 2 ? diagonal_in<2>() : diagonal_in<3>();
}
} // namespace kerf::dem
