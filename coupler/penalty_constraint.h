// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/constraint.h"
#include "coupler/interface_work.h"
#include "coupler/overlap_links.h"

#include <array>

namespace kerf
{
/// Penalty forces f_i = -k_i chi_i on the particle and N_a k_i chi_i on the nodes (seed, eq. 4).
///  - constant: k_i = k_DF for all (the seed);
///  - mass scaled: k_i = beta mu_i/dt^2 with the weighted masses of OverlapLinks::tied_masses(), so that the stiffness falls
///  with
///    the masses towards both ends of the overlap and adds at most beta to dt^2 omega^2, whatever the cells and weights.
/// Interface damping adds -2 xi sqrt(k_i mu_i) dchi_i/dt, a fraction xi of critical.
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
    double damping = 0.;   ///< xi [-]
  };

  /// @param packing kept by reference
  PenaltyConstraint(const Settings &settings, const dem::Packing &packing);

  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  Tie tie() const override { return Tie::spring; }
  Eigen::VectorXd springs() const override;
  ConstraintEnergy energy() const override { return {stored, -damping_work.local()}; }
  int n_particles() const override { return links.n_particles(); }

private:
  static constexpr int n_lanes = 4;
  typedef double Lanes __attribute__((vector_size(n_lanes * sizeof(double))));
  /// What a step needs of some springs of one cell. Lanes that are left over have no stiffness.
  template <int dim>
  struct Springs
  {
    Lanes origin[dim]; ///< stored positions of the particles [m]
    Lanes N[1 << dim]; ///< 0 for corners that a point does not need
    Lanes stiffness;   ///< [N/m]
    int particle[n_lanes];
    int link[n_lanes];
  };
  /// The springs of a cell stand one after the other: its nodes are looked up and pushed once for all of them.
  template <int dim>
  struct Cell
  {
    std::array<int, 1 << dim> node; ///< columns of the window
    int end = 0;                    ///< of its springs
  };
  template <int dim>
  struct Packed
  {
    std::vector<Cell<dim>> cells;
    std::vector<Springs<dim>> springs;
  };
  template <int dim>
  void pack(Packed<dim> &packed) const;
  template <int dim>
  void renumber(Packed<dim> &packed) const;
  template <int dim, bool periodic>
  void pull(const Packed<dim> &packed, dem::Particles &particles);
  template <int dim>
  void pull(const Packed<dim> &packed, dem::Particles &particles)
  {
    packing.periodic.isZero(0.) ? pull<dim, false>(packed, particles) : pull<dim, true>(packed, particles);
  }

  void choose_springs(const dem::Particles &particles, fem::FemSide &fem);
  void add_damping(dem::Particles &particles, fem::FemSide &fem);

  Settings settings;
  const dem::Packing &packing;
  OverlapLinks links;
  Packed<2> springs_2d; // of the links, one of the two
  Packed<3> springs_3d;
  std::vector<double> stiffness, viscosity; // of each link
  Eigen::Matrix3Xd node_displacement, node_velocity, node_force;
  int n_local = 0; // particles of this rank
  double stored = 0.;
  InterfaceWork damping_work;
};

/// What the case says of the penalty, for a step @p dt [s].
PenaltyConstraint::Settings penalty_settings(const Case &settings, double dt);
/// k_i of both kinds [N/m]; @p mu reduced mass [kg].
double penalty_stiffness(const PenaltyConstraint::Settings &settings, double share, double mu);
/// 2 xi sqrt(k share mu) [N s/m]
double penalty_viscosity(const PenaltyConstraint::Settings &settings, double share, double mu);
} // namespace kerf
