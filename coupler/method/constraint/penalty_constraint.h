// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/interface_work.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/constraint/constraint_model.h"
#include "coupler/method/constraint/corrector/corrected_springs.h"
#include "coupler/method/constraint/exchange/cell_batches.h"
#include "coupler/method/constraint/exchange/particle_interpolation.h"

namespace kerf
{
/// Penalty forces f_i = -k_i chi_i on the particle and N_a k_i chi_i on the nodes (Labra et al., eq. (4)).
///  - constant: k_i = k_DF for all (Labra et al.);
///  - mass scaled: k_i = beta mu_i/dt^2 with the weighted masses of ParticleInterpolation::tied_masses(). The stiffness
///    decreases with the masses towards both ends of the overlap. It adds at most beta to dt^2 omega^2 for any cells and
///    weights.
///
/// Interface damping adds -2 xi sqrt(k_i mu_i) dchi_i/dt, a fraction xi of critical damping. Theory (5.7).
///
/// With a corrector chi_i is the gap to the corrected position, which includes the fluctuation of the particle about the smooth
/// field (see Corrector). The nodes then receive the exact gradient of the spring energy. This energy is invariant under
/// rotations, so linear and angular momentum are conserved.
class PenaltyConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    bool mass_scaled = true;
    double stiffness = 0.; ///< k_DF [N/m] (2D: per metre), constant penalty only
    double beta = 0.;      ///< mass-scaled penalty only
    double time_step = 0.; ///< [s]
    double damping = 0.;   ///< xi [-], not with a corrector
    bool corrector = false;
    double k_n = 0., k_t = 0.; ///< stiffnesses of the bonds, for the fluctuations [N/m]
  };

  /// @param packing kept by reference
  PenaltyConstraint(const Settings &settings, const dem::Packing &packing);

  void set_time_step(double dt) override;
  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  void place(std::vector<dem::NewParticle> &particles, const fem::FemSide &fem) override;
  Tie tie() const override { return Tie::spring; }
  Eigen::VectorXd springs() const override;
  ConstraintEnergy energy() const override { return {stored, -damping_work.local()}; }
  int n_particles() const override { return interpolation.n_particles(); }

  Refusal refusal(double smallest_edge) const override;
  double bound_of_added_omega2(double dt, double lightest) const override;
  bool depends_on_overlap() const override { return !settings.mass_scaled; } // constant springs do not scale with the masses
  int cells_around() const override { return settings.corrector ? 2 : 1; }   // nodal strains use one more layer
  double operator_coefficient(const OperatorTie &tie, double dt) const override;
  std::vector<TieRow> rows(const fem::FemSide &fem, const std::vector<TiedParticle> &tied) override;

private:
  /// The springs of this rank.
  template <int dim>
  struct Springs
  {
    CellBatches<dim> cells;
    std::vector<SimdLanes> stiffness; ///< [N/m]
    CorrectedSprings<dim> corrected;  ///< with a corrector
  };
  template <int dim>
  void renew(Springs<dim> &springs, const dem::Particles &particles, fem::FemSide &fem);
  template <int dim>
  void apply(Springs<dim> &springs, dem::Particles &particles, fem::FemSide &fem);
  template <int dim, bool periodic>
  void pull(Springs<dim> &springs, dem::Particles &particles);

  void make_corrector(const fem::FemSide &fem);
  std::vector<double> masses_of_rows(const dem::Particles &particles, const fem::FemSide &fem);
  void choose_springs(const dem::Particles &particles, fem::FemSide &fem);
  void add_damping(dem::Particles &particles, fem::FemSide &fem);

  Settings settings;
  const dem::Packing &packing;
  ParticleInterpolation interpolation;
  Springs<2> springs_2d; // one of the two is used
  Springs<3> springs_3d;
  std::vector<double> stiffness, viscosity; // of each tied particle of this rank
  std::unique_ptr<Corrector> corrector;     // made at the first use of the finite elements
  std::vector<TiedParticle> tied;           // with a corrector only
  std::vector<double> of_nodes; // contribution of the nodes to 1/mu of each tied particle [1/kg]; empty: not known yet
  Eigen::Matrix3Xd node_displacement, node_velocity, node_force;
  int n_local = 0; // number of particles of this rank
  double stored = 0.;
  InterfaceWork damping_work;
};

/// The constant penalty and the mass-scaled one.
std::unique_ptr<Constraint> make_penalty(const ConstraintModel &model);
std::unique_ptr<Constraint> make_mass_scaled_penalty(const ConstraintModel &model);
/// Stiffness k_i of both kinds [N/m]. @param share see TiedParticle. @param mu reduced mass [kg]. Theory (5.3), (5.5).
double penalty_stiffness(const PenaltyConstraint::Settings &settings, double share, double mu);
/// Viscosity 2 xi sqrt(k share mu) [N s/m]. Theory (5.7).
double penalty_viscosity(const PenaltyConstraint::Settings &settings, double share, double mu);
} // namespace kerf
