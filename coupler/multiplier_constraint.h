// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/constraint.h"
#include "coupler/interface_work.h"
#include "coupler/multiplier_equations.h"
#include "coupler/overlap_links.h"

namespace kerf
{
/// Weak multipliers on the finite-element nodes: the mean velocity of the particles around every node of the overlap equals
/// that of the finite elements, exactly, at every half step (see MultiplierEquations). Particles keep their fluctuations about
/// that mean, which a random packing needs; a viscous tie relaxes them by a fraction rho a step, so that what the finite
/// elements cannot carry fades in the overlap. Towards the outer end of the overlap, where particles weigh less and less
/// against the loads that the multipliers pass on, weak springs hold each of them near its point.
class MultiplierConstraint : public Constraint
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
  MultiplierConstraint(const Settings &settings, const dem::Packing &packing);

  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  Tie tie() const override { return Tie::mean; }
  ConstraintEnergy energy() const override { return {stored, -work.local()}; }
  int n_particles() const override { return links.n_particles(); }

private:
  void build_equations(const dem::Particles &particles, const fem::FemSide &fem);
  void hold_light_particles(dem::Particles &particles, fem::FemSide &fem);
  void relax_fluctuations(dem::Particles &particles);
  void impose(double tau, dem::Particles &particles);
  void add_couples(dem::Particles &particles);

  Settings settings;
  const dem::Packing &packing;
  int rank = 0;
  OverlapLinks links;
  std::unordered_map<int, std::array<bool, 3>> blocked; // directions in which a tied particle cannot move, by packing index
  std::vector<double> c;                                // of each link
  std::vector<std::unique_ptr<MultiplierEquations>> equations;
  std::array<int, 3> equations_of_axis{};
  Eigen::Matrix3Xd inverse_node_mass, inverse_mass;           // of the window's nodes, of the links
  Eigen::Matrix3Xd displacement, velocity, force, node_force; // of the window's nodes
  Eigen::Matrix3Xd reaction;                                  // at the nodes
  std::vector<Eigen::Vector3d> link_force;                    // on the particles
  std::vector<double> spring;                                 // of each link [N/m]
  double stored = 0.;                                         // in the springs [J]
  InterfaceWork work;                                         // of all forces but the springs'
};

MultiplierConstraint::Settings multiplier_settings(const Case &settings, double dt);
/// What of a particle's fluctuation is relaxed and held: its share, but all of it where it weighs next to nothing. [-]
double fluctuation_share(double weight, double share);
/// holding (1 - w)^2 for that share, less where the particle's mass would make it govern the stable step [N/m]. @param mass
/// weighted [kg]
double holding_spring(const MultiplierConstraint::Settings &settings, double weight, double share, double mass);
} // namespace kerf
