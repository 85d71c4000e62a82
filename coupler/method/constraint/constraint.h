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
/// Energies of a constraint on this rank [J].
struct ConstraintEnergy
{
  double stored = 0.;     ///< in springs
  double dissipated = 0.; ///< extracted from both sides since the start, except by springs
};

/// The fluctuations of a random packing about the finite-element field that a constraint permits.
enum class Tie
{
  spring, ///< a spring on each particle: it comes to equilibrium with the bonds
  rigid,  ///< each particle follows the field: no fluctuations
  mean    ///< weighted means around nodes follow the field: fluctuations are free
};

/// Target displacement of a tied particle as a linear function of nodal displacements, sum_b P_b u_b, linearised about the
/// undeformed body.
struct TieRow
{
  std::vector<int> node; ///< mesh nodes
  std::vector<Eigen::Matrix3d> P;
  double inverse_node_mass = 0.; ///< contribution of the nodes to 1/mu [1/kg]; negative: a node has no mass
};

/// A tied particle in the coupled operator. Particle and nodes are given by their first degree of freedom.
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
  std::vector<std::pair<int, Eigen::Matrix3d>> row; ///< nodes and P, see TieRow; replaces N unless empty
};

/// Removes the motions that the constraint forbids.
class MotionProjection
{
public:
  virtual ~MotionProjection() = default;
  /// @param y motion times the square root of the mass, all degrees of freedom
  virtual void project(Eigen::VectorXd &y) const = 0;
};

/// Reason why a constraint cannot be used with its settings.
enum class Refusal
{
  none,
  ratio_too_large,  ///< unstable at any time step: Coupling/Penalty ratio of two or more
  cells_too_fine,   ///< too few particles in a cell for means around nodes
  unstable_overlap, ///< unstable at any time step in the overlap of the case
  too_much_damping  ///< damping and scaled penalty alone are unstable at any time step
};

/// Constrains the particles of the overlap to the displacement field of the finite elements,
///   chi_i = u_i - sum_a N_a(X_i) u_a = 0   (Labra et al., eq. (3)).
/// A method defines the forces that enforce it. Every method conserves linear and angular momentum, in one of two ways.
/// Particles and nodes receive opposite forces, distributed by the rows of N, which sum to one, and the nodes receive the
/// couple of forces that are not parallel to chi (see CoupleOnNodes). Or the forces are the gradient of an energy that is
/// invariant under rotations (see Corrector). Theory (5.1), (5.2).
///
/// A new method takes one source file and one line in make_constraint.cpp.
class Constraint
{
public:
  virtual ~Constraint() = default;

  /// Called before the first apply(). @param dt time step of both sides [s]
  virtual void set_time_step(double dt) = 0;

  /// Called after every conversion. @param particles all constrained particles of the model, the same on every rank
  virtual void set_particles(const std::vector<TiedParticle> &particles) = 0;

  /// Moves new particles from the finite-element field to the positions at which the constraint is satisfied. Collective.
  virtual void place(std::vector<dem::NewParticle> &, const fem::FemSide &) {}

  /// Adds the constraint forces at the present positions. All other forces of both sides have been computed. Collective.
  virtual void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) = 0;

  virtual Tie tie() const = 0;
  /// Stiffness of the constraint's springs on this rank's particles, in their order at the last apply() [N/m]; empty: no
  /// springs.
  virtual Eigen::VectorXd springs() const { return {}; }
  virtual ConstraintEnergy energy() const = 0;
  /// Number of constrained particles over all ranks.
  virtual int n_particles() const = 0;

  // The time step.

  /// Reason to refuse the settings before a run. The argument is the shortest cell edge in particle diameters [-].
  virtual Refusal refusal(double /*smallest_edge*/) const { return Refusal::none; }
  /// Upper bound of the contribution of the constraint to dt^2 omega^2 in an overlap that is not known yet [-]. @param dt time
  /// step [s]. @param lightest mass of a particle at the outer end of an overlap [kg]
  virtual double bound_of_added_omega2(double dt, double lightest) const = 0;
  /// Whether the bound holds for an average overlap only. Then the eigenvalue of an overlap is computed before the run.
  virtual bool depends_on_overlap() const { return false; }
  /// Number of cell layers around a tied particle whose nodes enter its constraint.
  virtual int cells_around() const { return 1; }

  // The coupled operator M^-1 (dt^2 K + 2 dt C), see CoupledOperator.

  /// dt^2 k + 2 dt c of a tie [kg]. Theory (8.2).
  virtual double operator_coefficient(const OperatorTie &tie, double dt) const = 0;
  /// Rows that replace the shape functions, one for each of @p tied. Empty when the constraint uses the shape functions.
  /// Collective.
  virtual std::vector<TieRow> rows(const fem::FemSide &, const std::vector<TiedParticle> & /*tied*/) { return {}; }
  /// Projection onto the motions that the constraint allows; null: it allows all. @p ties and @p inverse_root_mass of all
  /// degrees of freedom [1/sqrt(kg)] are kept by reference.
  virtual std::unique_ptr<MotionProjection> projection(const std::vector<OperatorTie> & /*ties*/,
                                                       const Eigen::VectorXd & /*inverse_root_mass*/) const
  {
    return nullptr;
  }
};
} // namespace kerf
