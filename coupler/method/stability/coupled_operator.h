// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/corrector.h"
#include "coupler/method/constraint/multiplier_system.h"
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
/// on the motions that multipliers allow (z = -1 of the step's amplification; Belytschko, Liu & Moran 2000, sec. 6.2).
/// The same on every rank.
class CoupledOperator
{
public:
  /// @param tied and @param active as in the run, by index in the packing. @param corrector of the penalties, if any.
  /// Collective.
  CoupledOperator(const Case &settings, const fem::FemSide &fem, const dem::Packing &packing, const Overlap &overlap,
                  const std::vector<TiedParticle> &tied, const std::vector<char> &active, const Box &part, MPI_Comm comm,
                  Corrector *corrector = nullptr);

  int n_dofs() const { return static_cast<int>(inverse_root_mass.size()); }

  /// lambda_max for a step [s]. Starts from the highest mode found before by this or an earlier operator (see keep_mode()).
  double highest(double dt, double tolerance, int max_products);
  /// Largest stable step [s]; @p guess: a step of the same order.
  double stable_step(double guess);

  /// The last highest mode by node and particle, and taking it over from the operator before a change of models.
  void take_mode(const CoupledOperator &before);

private:
  struct Tie
  {
    int particle = -1; ///< first degree of freedom
    int n = 0;
    std::array<int, 8> node; ///< first degrees of freedom
    std::array<double, 8> N;
    double share = 1., mass = 0., mu = 0.;            ///< [-], [kg], [kg]
    double measure = 0.;                              ///< c of the multipliers
    double weight = 0.;                               ///< of the particle
    std::vector<std::pair<int, Eigen::Matrix3d>> row; ///< in place of N with a corrector: first degrees of freedom, P
  };
  template <int dim>
  Eigen::Matrix<double, dim, 1> gap(const Tie &tie, const Eigen::VectorXd &x) const;
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
  void correct_ties(const fem::FemSide &fem, const std::vector<TiedParticle> &tied, Corrector &corrector);
  void build_multipliers();
  void remove_masses_of_held(const std::vector<TiedParticle> &tied);
  double tie_coefficient(const Tie &tie, double dt) const;
  void apply(double dt, const std::vector<double> &coefficients, const Eigen::VectorXd &y, Eigen::VectorXd &result) const;
  void add_sides(const Eigen::VectorXd &x, Eigen::VectorXd &force) const;
  void project(Eigen::VectorXd &y) const;
  Eigen::VectorXd start() const;
  Quotient quotient(const Eigen::VectorXd &y, double dt) const;

  const Case &settings;
  int dim;
  std::vector<int> nodes, particles;       // mesh nodes and packing indices that are part of it
  std::unordered_map<int, int> node_place; // of mesh nodes
  int first_particle_dof = 0;
  std::vector<Cell> cells;
  std::unique_ptr<dem::NetworkOperator> network;
  std::vector<Tie> ties;
  Eigen::VectorXd inverse_root_mass;           // 0 where the motion is prescribed
  std::unique_ptr<MultiplierSystem> equations; // weak multipliers only
  std::vector<int> multiplier_nodes;           // first degrees of freedom
  std::vector<int> tie_multipliers;            // 8 a tie: place among multiplier_nodes
  Eigen::VectorXd mode;
};
} // namespace kerf
