// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/interface_work.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/constraint/constraint_model.h"
#include "coupler/method/constraint/exchange/couple_on_nodes.h"
#include "coupler/method/constraint/exchange/force_history.h"

namespace kerf
{
/// Multipliers on the particles with their matrix lumped to its diagonal (Xiao & Belytschko 2004): every particle gets the
/// force that would make its velocity agree with the finite elements if its neighbours were pushed alike,
///   lambda_i = (dchi_i/dt + kappa chi_i/dt)/(dt D_i),   D_i = 1/m_i + sum_a N_ia/M_a sum_j N_ja.
/// Smooth motion is tied fully; what differs from particle to particle is damped, so waves that the finite elements cannot
/// carry are absorbed. kappa takes the gap itself back. Theory (5.19).
class LumpedMultiplierConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    double time_step = 0.; ///< [s]
    double closing = 0.;   ///< kappa, share of the gap that is taken back in a step, below 2 [-]
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
  double bound_of_added_omega2(double, double) const override { return 0.; }             // never lowers the limit
  double operator_coefficient(const OperatorTie &, double) const override { return 0.; } // likewise

private:
  /// The ties of this rank.
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
  Ties<2> ties_2d; // one of the two
  Ties<3> ties_3d;
  Eigen::Matrix3Xd inverse_node_mass, displacement, velocity, ahead, target, force, node_force; // of the window's nodes
  CoupleOnNodes couples;
  InterfaceWork work;
};

std::unique_ptr<Constraint> make_lumped_multipliers(const ConstraintModel &model);
} // namespace kerf
