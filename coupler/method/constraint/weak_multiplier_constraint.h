// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/interface_work.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/constraint/constraint_model.h"
#include "coupler/method/constraint/exchange/couple_on_nodes.h"
#include "coupler/method/constraint/exchange/force_history.h"
#include "coupler/method/constraint/exchange/particle_interpolation.h"
#include "coupler/method/constraint/multiplier_system.h"

namespace kerf
{
/// Weak multipliers on the finite-element nodes: the mean velocity of the particles around every node of the overlap equals
/// that of the finite elements, exactly, at every half step (see MultiplierSystem). Particles keep their fluctuations about
/// that mean, which a random packing needs; a viscous tie relaxes them by a fraction rho a step, so that what the finite
/// elements cannot carry fades in the overlap. Towards the outer end of the overlap, where particles weigh less and less
/// against the loads that the multipliers pass on, weak springs hold each of them near its point. Theory (5.9).
class WeakMultiplierConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    double time_step = 0.;  ///< [s]
    double relaxation = 0.; ///< rho, share of a fluctuation taken out in a step [-]
    double holding = 0.;    ///< stiffness of the springs on particles that weigh next to nothing, see holding_spring() [N/m]
  };

  /// @param packing kept by reference
  WeakMultiplierConstraint(const Settings &settings, const dem::Packing &packing);

  void set_time_step(double dt) override;
  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  Tie tie() const override { return Tie::mean; }
  ConstraintEnergy energy() const override { return {stored, -work.local()}; }
  int n_particles() const override { return interpolation.n_particles(); }

  Refusal refusal(double smallest_edge) const override;
  double bound_of_added_omega2(double dt, double lightest) const override;
  double operator_coefficient(const OperatorTie &tie, double dt) const override;
  std::unique_ptr<MotionProjection> projection(const std::vector<OperatorTie> &ties,
                                               const Eigen::VectorXd &inverse_root_mass) const override;

private:
  /// The ties of this rank: what a step needs of them, and the loads of the present step.
  template <int dim>
  struct Ties
  {
    CellBatches<dim> cells;
    ForceHistory<dim> loads;          ///< the springs' apart
    std::vector<SimdLanes> c;         ///< see MultiplierSystem
    std::vector<SimdLanes> spring;    ///< [N/m]
    std::vector<SimdLanes> viscosity; ///< rho m/dt times fluctuation_share() [N s/m]
    InverseMass<dim> inverse_mass;
    // of each pack
    std::vector<SimdPack> gap;      ///< -chi [m]
    std::vector<SimdPack> velocity; ///< of the particles [m/s]
    std::vector<SimdPack> relaxed;  ///< force of the relaxation on the particles [N]
  };

  template <int dim>
  void apply(Ties<dim> &ties, dem::Phase phase, dem::Particles &particles, fem::FemSide &fem);
  template <int dim>
  void renew(Ties<dim> &ties, const dem::Particles &particles, const fem::FemSide &fem);
  template <int dim>
  void build_equations(const Ties<dim> &ties, const dem::Particles &particles, const fem::FemSide &fem);
  template <int dim, bool periodic>
  void gather_gaps(Ties<dim> &ties, double tau, dem::Particles &particles);
  template <int dim>
  void solve(double tau);
  template <int dim>
  double scatter_forces(Ties<dim> &ties, dem::Particles &particles);

  Settings settings;
  const dem::Packing &packing;
  int rank = 0;
  ParticleInterpolation interpolation;
  std::unique_ptr<MultiplierSystem> equations;
  Ties<2> ties_2d; // one of the two
  Ties<3> ties_3d;
  Eigen::Matrix3Xd inverse_node_mass, displacement, velocity, force; // of the window's nodes
  Eigen::Matrix<double, 9, Eigen::Dynamic> sums;                     // three vectors for each node, see gather_gaps()
  Eigen::MatrixXd lambda, ahead;                                     // of the nodes, a row an axis
  Eigen::Matrix3Xd node_force, reaction;                             // without and with the springs'
  double stored = 0.;                                                // in the springs [J]
  CoupleOnNodes couples;
  InterfaceWork work; // of all forces but the springs'
};

std::unique_ptr<Constraint> make_weak_multipliers(const ConstraintModel &model);
/// What of a particle's fluctuation is relaxed and held: its share, but all of it where it weighs next to nothing. [-] Theory
/// (5.16).
double fluctuation_share(double weight, double share);
/// holding (1 - w)^2 for that share, less where the particle's mass would make it govern the stable step [N/m]. @param mass
/// weighted [kg]
double holding_spring(const WeakMultiplierConstraint::Settings &settings, double weight, double share, double mass);
} // namespace kerf
