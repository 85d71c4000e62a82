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
/// The linear coupled model at rest, or the part of it in a box: weighted finite elements, weighted bonds and what ties them.
/// Velocity Verlet with forces from velocities of half a step ago is stable while
///   lambda_max(M^-1 (dt^2 K + 2 dt C)) <= 4,
/// on the motions that multipliers allow (z = -1 of the step's amplification; Belytschko, Liu & Moran 2000, sec. 6.2). Theory
/// (8.1). The same on every rank.
class CoupledOperator
{
public:
  /// @param constraint kept by reference. @p tied and @p active as in the run, by index in the packing. Collective.
  CoupledOperator(const dem::NetworkOperator::Material &bonds, Constraint &constraint, const fem::FemSide &fem,
                  const dem::Packing &packing, const Overlap &overlap, const std::vector<TiedParticle> &tied,
                  const std::vector<char> &active, const Box &part, MPI_Comm comm);
  CoupledOperator(const CoupledOperator &) = delete; // the restriction refers to its parts

  int n_dofs() const { return static_cast<int>(inverse_root_mass.size()); }

  /// lambda_max for a step [s]. Starts from the highest mode found before by this or an earlier operator (see keep_mode()).
  double highest(double dt, double tolerance, int max_products);
  /// Largest stable step [s]; @p guess: a step of the same order.
  double stable_step(double guess);

  /// The last highest mode by node and particle, and taking it over from the operator before a change of models.
  void take_mode(const CoupledOperator &before);

private:
  template <int dim>
  Eigen::Matrix<double, dim, 1> gap(const OperatorTie &tie, const Eigen::VectorXd &x) const;
  template <int dim>
  void pull(const std::vector<double> &coefficients, const Eigen::VectorXd &x, Eigen::VectorXd &force) const;
  struct Cell
  {
    std::vector<int> dof; ///< first one of each node
    fem::CellStiffness K; ///< of those nodes: slaves have given theirs to their masters
  };
  /// lambda of a fixed motion as a polynomial in the step: square dt^2 + linear dt + constant.
  struct Quotient
  {
    double square = 0., linear = 0., constant = 0.;
    double step_at(double lambda) const;
  };

  void add_cells(const fem::FemSide &fem, const Box &part, MPI_Comm comm);
  void add_ties(const fem::FemSide &fem, const dem::Packing &packing, const Overlap &overlap,
                const std::vector<TiedParticle> &tied);
  void replace_rows(const std::vector<TieRow> &rows, const std::vector<TiedParticle> &tied);
  void remove_masses_of_held(const std::vector<TiedParticle> &tied);
  void apply(double dt, const std::vector<double> &coefficients, const Eigen::VectorXd &y, Eigen::VectorXd &result) const;
  void add_sides(const Eigen::VectorXd &x, Eigen::VectorXd &force) const;
  Eigen::VectorXd start() const;
  Quotient quotient(const Eigen::VectorXd &y, double dt) const;

  const Constraint &constraint;
  int dim;
  std::vector<int> nodes, particles;       // mesh nodes and packing indices that are part of it
  std::unordered_map<int, int> node_place; // of mesh nodes
  int first_particle_dof = 0;
  std::vector<Cell> cells;
  std::unique_ptr<dem::NetworkOperator> network;
  std::vector<OperatorTie> ties;
  Eigen::VectorXd inverse_root_mass; // 0 where the motion is prescribed
  std::unique_ptr<MotionProjection> restriction;
  Eigen::VectorXd mode;
};

/// Part of the model to take an operator of: cells, the overlap around them, and the particles that bonds join to it.
/// @param reach around the cells [m]
Box part_around(const fem::Mesh &mesh, const std::vector<int> &cells, double reach);
/// The reach of an overlap and of its constraint [m].
double reach_of_overlap(const ModelSettings &settings, const Constraint &constraint);
} // namespace kerf
