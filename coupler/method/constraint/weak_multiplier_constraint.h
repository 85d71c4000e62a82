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
/// Weak multipliers on the finite-element nodes. The weighted mean velocity of the particles around every node of the overlap
/// equals that of the finite elements exactly at every half step (see MultiplierSystem). The fluctuations about the mean, which
/// a random packing needs for equilibrium, are free. A viscous force relaxes them by a fraction rho in every step, so motions
/// that the finite elements cannot represent decay in the overlap. Towards the outer end of the overlap the weights of the
/// particles become small compared with the multiplier forces. There weak springs hold each particle near the finite-element
/// field. Theory (5.9), (5.15), (5.17).
class WeakMultiplierConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    double time_step = 0.;  ///< [s]
    double relaxation = 0.; ///< rho, fraction of a fluctuation that is removed in a step [-]
    double holding = 0.;    ///< stiffness of the springs on particles of weight zero, see holding_spring() [N/m]
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
  /// The tied particles of this rank: constants of a step and forces of the present step.
  template <int dim>
  struct Ties
  {
    CellBatches<dim> cells;
    ForceHistory<dim> loads;          ///< constraint forces without the springs
    std::vector<SimdLanes> c;         ///< see MultiplierSystem
    std::vector<SimdLanes> spring;    ///< [N/m]
    std::vector<SimdLanes> viscosity; ///< rho m/dt times fluctuation_share() [N s/m]
    InverseMass<dim> inverse_mass;
    // one value for each pack
    std::vector<SimdPack> gap;      ///< -chi [m]
    std::vector<SimdPack> velocity; ///< velocity of the particles [m/s]
    std::vector<SimdPack> relaxed;  ///< relaxation force on the particles [N]
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
  Ties<2> ties_2d; // one of the two is used
  Ties<3> ties_3d;
  Eigen::Matrix3Xd inverse_node_mass, displacement, velocity, force; // at the nodes of the nodal window
  Eigen::Matrix<double, 9, Eigen::Dynamic> sums;                     // three vectors at each node, see gather_gaps()
  Eigen::MatrixXd lambda, ahead;                                     // at the nodes, one row for each axis
  Eigen::Matrix3Xd node_force, reaction;                             // nodal forces without and with those of the springs
  double stored = 0.;                                                // energy of the springs [J]
  CoupleOnNodes couples;
  InterfaceWork work; // work of all constraint forces except the springs
};

std::unique_ptr<Constraint> make_weak_multipliers(const ConstraintModel &model);
/// Fraction of a particle's fluctuation that relaxation and springs act on [-]: its share, but at least one minus its weight.
/// Theory (5.16).
double fluctuation_share(double weight, double share);
/// Stiffness of the holding spring [N/m]: fluctuation_share() times holding (1 - w)^2. It is limited by the weighted @p mass
/// [kg], so that it does not govern the stable step. Theory (5.17).
double holding_spring(const WeakMultiplierConstraint::Settings &settings, double weight, double share, double mass);
} // namespace kerf
