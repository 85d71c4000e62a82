// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/interface_work.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/constraint/constraint_model.h"
#include "coupler/method/constraint/exchange/couple_on_nodes.h"
#include "coupler/method/constraint/exchange/force_history.h"

namespace kerf
{
/// Multipliers on the particles with a lumped constraint matrix (Xiao & Belytschko 2004). The force on a particle would make
/// its velocity equal to that of the finite elements if its neighbours received the same force,
///   lambda_i = (dchi_i/dt + kappa chi_i/dt)/(dt D_i),   D_i = 1/m_i + sum_a N_ia/M_a sum_j N_ja.
/// Smooth motions satisfy the constraint exactly. Motions that vary from particle to particle are damped, so waves that the
/// finite elements cannot represent are absorbed. The term with kappa reduces the displacement gap. Theory (5.19).
class LumpedMultiplierConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    double time_step = 0.; ///< [s]
    double closing = 0.;   ///< kappa, fraction of the gap that is removed in a step, below 2 [-]
  };

  /// @param packing kept by reference
  LumpedMultiplierConstraint(const Settings &settings, const dem::Packing &packing);

  void set_time_step(double dt) override;
  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  Tie tie() const override { return Tie::rigid; }
  ConstraintEnergy energy() const override { return {0., -work.local()}; }
  int n_particles() const override { return interpolation.n_particles(); }

  Refusal refusal(double) const override { return settings.closing >= 2. ? Refusal::ratio_too_large : Refusal::none; }
  double bound_of_added_omega2(double, double) const override { return 0.; }             // does not reduce the stable step
  double operator_coefficient(const OperatorTie &, double) const override { return 0.; } // nor here

private:
  /// The tied particles of this rank.
  template <int dim>
  struct Ties
  {
    CellBatches<dim> cells;
    ForceHistory<dim> loads;
    InverseMass<dim> inverse_mass;
    std::vector<SimdLanes> pulled; ///< share/D_i [kg]
  };
  template <int dim>
  void apply(Ties<dim> &ties, dem::Phase phase, dem::Particles &particles, fem::FemSide &fem);
  template <int dim>
  void renew(Ties<dim> &ties, const dem::Particles &particles, fem::FemSide &fem);
  template <int dim, bool periodic>
  double pull(Ties<dim> &ties, double tau, dem::Particles &particles);

  Settings settings;
  const dem::Packing &packing;
  ParticleInterpolation interpolation;
  Ties<2> ties_2d; // one of the two is used
  Ties<3> ties_3d;
  Eigen::Matrix3Xd inverse_node_mass, displacement, velocity, ahead, target, force, node_force; // at window nodes
  CoupleOnNodes couples;
  InterfaceWork work;
};

std::unique_ptr<Constraint> make_lumped_multipliers(const ConstraintModel &model);
} // namespace kerf
