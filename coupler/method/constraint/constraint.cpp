// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/lumped_multiplier_constraint.h"
#include "coupler/method/constraint/penalty_constraint.h"
#include "coupler/method/constraint/weak_multiplier_constraint.h"

namespace kerf
{
PenaltyConstraint::Settings penalty_settings(const Case &settings, double dt)
{
  PenaltyConstraint::Settings penalty;
  penalty.mass_scaled = settings.constraint == ConstraintMethod::penalty_mass_scaled;
  penalty.beta = settings.penalty_ratio;
  penalty.stiffness = settings.penalty_ratio * settings.bond.k_n;
  penalty.time_step = dt;
  penalty.damping = settings.interface_damping;
  penalty.corrector = settings.corrector;
  penalty.k_n = settings.bond.k_n;
  penalty.k_t = settings.bond.k_t;
  return penalty;
}

std::unique_ptr<Constraint> make_constraint(const Case &settings, const dem::Packing &packing, double dt, MPI_Comm comm,
                                            std::shared_ptr<const Fluctuations> fluctuations)
{
  if (settings.constraint == ConstraintMethod::multipliers)
  {
    WeakMultiplierConstraint::Settings multipliers = multiplier_settings(settings, dt);
    multipliers.comm = comm;
    return std::make_unique<WeakMultiplierConstraint>(multipliers, packing);
  }
  if (settings.constraint == ConstraintMethod::multipliers_diagonal)
    return std::make_unique<LumpedMultiplierConstraint>(LumpedMultiplierConstraint::Settings{comm, dt, settings.penalty_ratio},
                                                        packing);
  PenaltyConstraint::Settings penalty = penalty_settings(settings, dt);
  penalty.comm = comm;
  penalty.fluctuations = std::move(fluctuations);
  return std::make_unique<PenaltyConstraint>(penalty, packing);
}
} // namespace kerf
