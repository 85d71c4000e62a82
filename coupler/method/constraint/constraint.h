// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <array>
#include <memory>
#include <utility>
#include <vector>

namespace kerf
{
/// Energies of a constraint, of this rank [J].
struct ConstraintEnergy
{
  double stored = 0.;     ///< in springs
  double dissipated = 0.; ///< taken from both sides since the start, springs apart
};

/// Which fluctuations of a random packing about the field of the finite elements a constraint permits.
enum class Tie
{
  spring, ///< each particle is held by a spring of its own: it comes to rest between that and its bonds
  rigid,  ///< each particle follows its point
  mean    ///< averages around nodes follow, single particles are free
};

/// The place that a tied particle is held at, by the displacements of nodes about the body at rest: sum_b P_b u_b.
struct TieRow
{
  std::vector<int> node; ///< of the mesh
  std::vector<Eigen::Matrix3d> P;
  double inverse_node_mass = 0.; ///< the nodes' part of 1/mu [1/kg]; negative: a node has no mass
};

/// A tied particle in the coupled operator. Degrees of freedom are named by the first one of a particle or node.
struct OperatorTie
{
  int particle = -1;
  int n = 0;
  std::array<int, 8> node;
  std::array<double, 8> N;
  double share = 1.;                                ///< see TiedParticle [-]
  double weight = 0.;                               ///< DE weight of the particle [-]
  double mass = 0.;                                 ///< weighted mass of the particle [kg]
  double mu = 0.;                                   ///< reduced mass, see ParticleInterpolation::tied_masses() [kg]
  double measure = 0.;                              ///< share times volume [m^3], 2D [m^2]
  std::vector<std::pair<int, Eigen::Matrix3d>> row; ///< in place of N: nodes and P, see TieRow
};

/// Removes from motions of the coupled model those that a constraint forbids.
class MotionProjection
{
public:
  virtual ~MotionProjection() = default;
  /// @param y motion times the root of the mass, all degrees of freedom
  virtual void project(Eigen::VectorXd &y) const = 0;
};

/// Why a constraint cannot be used with its settings.
enum class Refusal
{
  none,
  ratio_too_large, ///< unstable at any time step: Coupling/Penalty ratio of two or more
  cells_too_fine,  ///< too few particles for means around nodes
  unstable_overlap ///< unstable at any time step in the overlap at hand
};

/// Ties the particles of the overlap to the displacement field of the finite elements:
/// chi_i = u_i - sum_a N_a(X_i) u_a = 0 (Labra et al., eq. (3)). A method decides which forces enforce it. Every method pushes
/// particles and nodes by opposite forces along the rows of N, which sum to one, and nodes get the couple back that a force not
/// along chi makes (see CoupleOnNodes), or all forces are the gradient of an energy that no rotation changes (see Corrector):
/// linear and angular momentum are kept. Theory (5.1), (5.2).
///
/// A method is one source file and one line in make_constraint.cpp.
class Constraint
{
public:
  virtual ~Constraint() = default;

  /// Before the first force. @param dt step of both sides [s]
  virtual void set_time_step(double dt) = 0;

  /// After every activation: the constrained particles of the whole model (same list on every rank).
  virtual void set_particles(const std::vector<TiedParticle> &particles) = 0;

  /// Moves new particles from the smooth field of the finite elements to where the constraint holds them. Collective.
  virtual void place(std::vector<dem::NewParticle> &, const fem::FemSide &) {}

  /// Adds the forces for the present positions, after all other forces of both sides. Collective.
  virtual void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) = 0;

  virtual Tie tie() const = 0;
  /// Stiffness of the springs on this rank's particles, in their order at the last apply() [N/m]; empty: no springs.
  virtual Eigen::VectorXd springs() const { return {}; }
  virtual ConstraintEnergy energy() const = 0;
  /// Number of constrained particles of the whole model.
  virtual int n_particles() const = 0;

  // The time step.

  /// Why no run should start. @param smallest_edge of the cells, in particle diameters
  virtual Refusal refusal(double /*smallest_edge*/) const { return Refusal::none; }
  /// Upper bound of what the constraint adds to dt^2 omega^2 in an overlap that is not known yet [-]. @param lightest mass of a
  /// particle at the end of an overlap [kg]
  virtual double bound_of_added_omega2(double dt, double lightest) const = 0;
  /// The bound holds for a mean overlap only: a real one has to be solved before the run.
  virtual bool depends_on_overlap() const { return false; }
  /// Layers of cells around those of a tied particle whose nodes move its place.
  virtual int cells_around() const { return 1; }

  // The coupled operator M^-1 (dt^2 K + 2 dt C), see CoupledOperator.

  /// dt^2 k + 2 dt c of a tie [kg]. Theory (8.2).
  virtual double operator_coefficient(const OperatorTie &tie, double dt) const = 0;
  /// Rows in place of the shape functions, one for each of @p tied; empty: the shape functions. Collective.
  virtual std::vector<TieRow> rows(const fem::FemSide &, const std::vector<TiedParticle> & /*tied*/) { return {}; }
  /// Restriction of the motions; null: none. @param inverse_root_mass of all degrees of freedom, kept by reference.
  /// @param ties kept by reference
  virtual std::unique_ptr<MotionProjection> projection(const std::vector<OperatorTie> & /*ties*/,
                                                       const Eigen::VectorXd & /*inverse_root_mass*/) const
  {
    return nullptr;
  }
};
} // namespace kerf
