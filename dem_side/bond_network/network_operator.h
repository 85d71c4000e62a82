// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/stored_bonds.h"

#include <Eigen/Core>

namespace kerf::dem
{
/// The linear network of the bonds and their dashpots among selected particles of a packing, matrix-free. The degrees of
/// freedom of the p-th particle begin at per_particle() * p: translations [m], then rotations [rad].
class NetworkOperator
{
public:
  struct Material
  {
    double k_n = 0., k_t = 0.; ///< of a bond [N/m]
    double density = 0.;       ///< of the particles [kg/m^3]
    double damping = 0.;       ///< of the bonds, fraction of critical [-]
  };

  /// @param particles indices in the packing, ascending (else std::logic_error). @param active by index in the packing:
  /// particles that exist; bonds to others do not count. @param weight by index in the packing, see bond_weight().
  NetworkOperator(const Packing &packing, const StoredBonds &stored_bonds, const Material &material,
                  const std::vector<int> &particles, const std::vector<char> &active, const Eigen::VectorXd &weight);

  int per_particle() const { return dim == 2 ? 3 : 6; }
  int n_dofs() const { return static_cast<int>(inertia.size()); }
  /// Of each degree of freedom: weighted mass [kg] or moment of inertia [kg m^2], as with DemSide::set_weights().
  const Eigen::VectorXd &masses() const { return inertia; }
  /// y += K x: forces [N] and torques [N m] that hold the displacements and rotations x.
  void add_product(const Eigen::Ref<const Eigen::VectorXd> &x, Eigen::Ref<Eigen::VectorXd> y) const { add_sum(1., 0., x, y); }
  /// y += (stiff K + viscous C) x, with the matrix C of the dashpots. Theory (3.14), (3.15).
  void add_sum(double stiff, double viscous, const Eigen::Ref<const Eigen::VectorXd> &x, Eigen::Ref<Eigen::VectorXd> y) const;
  /// Adds dashpots against the translations of single particles to C. @param c by place of the particle [N s/m]
  void add_dashpots(const Eigen::VectorXd &c) { dashpots = c; }
  /// The same for particles that follow a homogeneous strain without rotation, also across periodic axes.
  void add_homogeneous(const Eigen::Matrix3d &strain, Eigen::Ref<Eigen::VectorXd> y) const;
  /// Diagonal of K.
  Eigen::VectorXd diagonal() const;

private:
  struct Bond
  {
    int first, second;        ///< indices of their first degree of freedom
    Eigen::Vector3d normal;   ///< from the first to the second
    double lever, reach;      ///< from the first, from the second centre to the contact point [m]
    double normal_k, shear_k; ///< weighted stiffness [N/m]
    double rolling_k;         ///< against relative rotation, see rolling_resistance() [N m]
    double normal_c, shear_c; ///< of the dashpots [N s/m]
  };
  template <int dim>
  void add_homogeneous_in(const Eigen::Matrix3d &strain, Eigen::Ref<Eigen::VectorXd> y) const;
  template <int dim>
  Eigen::VectorXd diagonal_in() const;
  template <int dim>
  void add_sum_in(double stiff, double viscous, const Eigen::Ref<const Eigen::VectorXd> &x,
                  Eigen::Ref<Eigen::VectorXd> y) const;

  int dim;
  std::vector<Bond> bonds;
  Eigen::VectorXd inertia, dashpots;
};
} // namespace kerf::dem
