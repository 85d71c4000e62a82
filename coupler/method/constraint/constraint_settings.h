// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <string>

namespace kerf
{
/// The constraint in the overlap. Each method uses its own subset of the parameters.
struct ConstraintSettings
{
  std::string method = "weak_multipliers"; ///< one of constraint_methods()
  double penalty_ratio = 0.;               ///< beta (mass scaled), k_DF/k_n (constant) or kappa (lumped multipliers) [-]
  bool corrector = false;                  ///< the penalties admit the fluctuations of a packing
  double interface_damping = 0.;           ///< damping ratio xi of the penalties [-]
  double fluctuation_relaxation = 0.;      ///< rho of the weak multipliers [-]
};
} // namespace kerf
