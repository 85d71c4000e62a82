// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint.h"
#include "coupler/method/model_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/stability/lanczos.h"
#include "dem_side/bond_network/network_operator.h"
#include "fem_side/fem_side.h"

#include <memory>
#include <unordered_map>

namespace kerf
{
/// The coupled model linearised about the undeformed state, or the part of it in a box: weighted finite elements, weighted
/// bonds with their dashpots and the constraint. Velocity Verlet with damping forces from the velocities of half a step before
/// is stable while
///   lambda_max(M^-1 (dt^2 K + 2 dt C)) <= 4,
/// on the motions that the multipliers allow (root z = -1 of the amplification matrix; Belytschko, Liu & Moran 2000, sec. 6.2).
/// Theory (8.1). The operator is the same on every rank.
class CoupledOperator
{
public:
  /// @param constraint kept by reference. @param tied tied particles as in the run. @param active active particles by index in
  /// the packing. @param part box of the part [m]. Collective.
  CoupledOperator(const dem::NetworkOperator::Material &bonds, Constraint &constraint, const fem::FemSide &fem,
                  const dem::Packing &packing, const Overlap &overlap, const std::vector<TiedParticle> &tied,
                  const std::vector<char> &active, const Box &part, MPI_Comm comm);
  CoupledOperator(const CoupledOperator &) = delete; // the projection refers to members

  int n_dofs() const { return static_cast<int>(inverse_root_mass.size()); }

  /// lambda_max [-] for the step @p dt [s], by highest_mode(). The iteration starts from the highest mode that this or an
  /// earlier operator found (see take_mode()).
  double highest(double dt, double tolerance, int max_products);
  /// Largest step at which lambda_max is not above @p limit [s]; 0: there is none. @param guess step of the same order [s]
  double stable_step(double guess, double limit = 4.);

  /// Uses the highest mode of the operator before a conversion as the start of the next iteration. Nodes and particles are
  /// matched.
  void take_mode(const CoupledOperator &before);

private:
  template <int dim>
  Eigen::Matrix<double, dim, 1> gap(const OperatorTie &tie, const Eigen::VectorXd &x) const;
  template <int dim>
  void pull(const std::vector<double> &coefficients, const Eigen::VectorXd &x, Eigen::VectorXd &force) const;
  struct Cell
  {
    std::vector<int> dof; ///< first degree of freedom of each node
    fem::CellStiffness K; ///< stiffness of these nodes; hanging nodes are condensed into their masters
  };
  /// Rayleigh quotient of a fixed motion for any step.
  struct Quotient
  {
    double square = 0., linear = 0.; ///< of the sides, by the power of the step
    std::vector<double> gap2;        ///< squared gap of each tie
  };

  void add_cells(const fem::FemSide &fem, const Box &part, MPI_Comm comm);
  void add_ties(const fem::FemSide &fem, const dem::Packing &packing, const Overlap &overlap,
                const std::vector<TiedParticle> &tied);
  void replace_rows(const std::vector<TieRow> &rows, const std::vector<TiedParticle> &tied);
  void remove_masses_of_held(const std::vector<TiedParticle> &tied);
  void apply(double dt, const std::vector<double> &coefficients, const Eigen::VectorXd &y, Eigen::VectorXd &result) const;
  void add_sides(double stiff, double viscous, const Eigen::VectorXd &x, Eigen::VectorXd &force) const;
  Eigen::VectorXd start() const;
  Quotient quotient(const Eigen::VectorXd &y) const;
  double value_of(const Quotient &quotient, double dt) const;

  const Constraint &constraint;
  int dim;
  std::vector<int> nodes, particles;       // mesh nodes and packing indices in the part
  std::unordered_map<int, int> node_place; // position in nodes, by mesh node
  int first_particle_dof = 0;
  std::vector<Cell> cells;
  std::unique_ptr<dem::NetworkOperator> network;
  std::vector<OperatorTie> ties;
  Eigen::VectorXd inverse_root_mass; // 0 where the motion is prescribed
  std::unique_ptr<MotionProjection> restriction;
  Eigen::VectorXd mode;
};

/// Box around @p cells, extended by @p reach [m], for an operator of this part of the model.
Box part_around(const fem::Mesh &mesh, const std::vector<int> &cells, double reach);
/// Distance around converted cells within which the overlap, its constraint and bonded particles lie [m].
double reach_of_overlap(const ModelSettings &settings, const Constraint &constraint);
} // namespace kerf
