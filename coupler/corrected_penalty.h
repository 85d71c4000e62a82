// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/corrector.h"
#include "coupler/penalty_constraint.h"

namespace kerf
{
/// Penalty forces for chi_i = u_i - N u - C_i : eps(u): a random packing keeps the places that it fluctuates to about the
/// smooth field. Forces act along the transpose of the whole row, so energy and linear momentum are kept. Rows do not see small
/// rotations, so angular momentum is kept but for the rotation and the strains: couples that keep it exactly would feed energy
/// into the body. Like small strains it is for rock that does not turn by much.
class CorrectedPenalty : public Constraint
{
public:
  struct Settings
  {
    PenaltyConstraint::Settings penalty;
    double k_n = 0., k_t = 0.; ///< of the bonds [N/m]
  };
  /// @param packing kept by reference
  CorrectedPenalty(const Settings &settings, const dem::Packing &packing);

  void set_particles(const std::vector<TiedParticle> &particles) override;
  void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) override;
  void place(std::vector<dem::NewParticle> &particles, const fem::FemSide &fem) override;
  Tie tie() const override { return Tie::spring; }
  Eigen::VectorXd springs() const override;
  ConstraintEnergy energy() const override { return {stored, 0.}; }
  int n_particles() const override { return static_cast<int>(tied.size()); }

private:
  const Corrector &corrector_for(const fem::FemSide &fem);
  void renew(fem::FemSide &fem);

  Settings settings;
  const dem::Packing &packing;
  std::unique_ptr<Corrector> corrector; // made when the finite elements are known
  std::vector<TiedParticle> tied;
  std::vector<Corrector::Row> rows; // of all tied particles; nodes are columns of the window
  std::vector<double> others;       // of 1/mu, what the nodes add [1/kg]
  std::vector<int> window, row_of;  // row by index in the packing, -1: not tied
  Eigen::Matrix3Xd node_displacement, node_force;
  Eigen::VectorXd spring; // of this rank's particles
  bool stale = false;
  double stored = 0.;
};

/// For each row, sum_b |P_b|/M_b sum_j share_j |P_jb| [1/kg]: with 1/m_i the inverse of the mass that the spring moves, see
/// OverlapLinks::tied_masses(). Negative when a node has no mass.
std::vector<double> inverse_masses_of_nodes(const std::vector<Corrector::Row> &rows, const std::vector<TiedParticle> &tied,
                                            const Eigen::VectorXd &node_mass);
} // namespace kerf
