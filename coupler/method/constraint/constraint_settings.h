// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <string>

namespace kerf
{
/// How the overlap is tied. Each method uses its own part of the numbers.
struct ConstraintSettings
{
  std::string method = "multipliers"; ///< one of constraint_methods()
  double penalty_ratio = 0.;          ///< beta (mass scaled), k_DF/k_n (constant) or kappa (lumped multipliers) [-]
  bool corrector = false;             ///< the penalties leave a packing its fluctuations
  double interface_damping = 0.;      ///< xi of the penalties [-]
  double fluctuation_relaxation = 0.; ///< rho of the weak multipliers [-]
};
} // namespace kerf
