// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace kerf
{
/// Energies of the coupled body [J]. Both sides are weighted, so that the overlap does not count twice. Work and losses are
/// summed from the start of the run.
struct EnergyLedger
{
  double kinetic = 0.;
  double finite_step = 0.; ///< of both sides, see dem::Energies and fem::Energies
  double elastic = 0.;
  double coupling = 0.; ///< stored in the springs of the constraint
  double damping = 0., friction = 0., released = 0.;
  double interface = 0.; ///< taken by the constraint, without the energy of its springs
  double absorbed = 0.;
  double left = 0.; ///< with particles that left the domain
  double boundary_work = 0.;
  double tool_work = 0.;       ///< on both sides: force times displacement of the particle or surface point it acts on
  double conversion = 0.;      ///< energy after less energy before, summed over all changes of models
  double conversion_gain = 0.; ///< sum of the changes of models that created energy alone
  double initial = 0.;         ///< held() + lost() - work() at the start

  /// Energy of the body now.
  double held() const { return kinetic + finite_step + elastic + coupling; }
  /// Energy that it has lost.
  double lost() const { return damping + friction + released + interface + absorbed + left; }
  double work() const { return tool_work + boundary_work; }
  /// Error of the balance; round-off when every part is accounted for. Theory (10.3).
  double residual() const { return held() + lost() - initial - work() - conversion; }
  /// Sum of the amounts of all changes by conversions, of either sign.
  double changed_by_conversions() const { return 2. * conversion_gain - conversion; }
  /// Energy put in: the scale of the residual and of what conversions create. Theory (10.8), (10.10).
  double turnover() const { return std::max(std::abs(initial), std::abs(tool_work) + std::abs(boundary_work)); }
  /// One line that names the part that changed most since @p before, with both values (for a run that fails).
  std::string fastest_growing(const EnergyLedger &before) const;
};
} // namespace kerf
