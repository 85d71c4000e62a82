// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <string>
#include <vector>

namespace kerf
{
/// Energies of the coupled body [J], both sides weighted, so that they sum up without double counting. Work and losses count
/// from the start of the run.
struct EnergyLedger
{
  double kinetic = 0.;
  double finite_step = 0.; ///< of both sides, see dem::Energies and fem::Energies
  double elastic = 0.;
  double coupling = 0.; ///< stored in the springs of the constraint
  double damping = 0., friction = 0., released = 0.;
  double interface = 0.; ///< taken by the constraint, springs apart
  double absorbed = 0.;
  double boundary_work = 0.;
  double tool_work = 0.;  ///< on both sides: force times the way of what it acts on
  double conversion = 0.; ///< came in by changes of models: energy after less energy before each of them
  double initial = 0.;    ///< held() + lost() - work() at the start

  /// What the body holds now.
  double held() const { return kinetic + finite_step + elastic + coupling; }
  /// What it has lost.
  double lost() const { return damping + friction + released + interface + absorbed; }
  double work() const { return tool_work + boundary_work; }
  /// What is missing in the balance; a sum of round-off when every part is accounted for.
  double residual() const { return held() + lost() - initial - work() - conversion; }
  /// The largest amount of energy the balance deals with, to compare the residual with.
  double turnover() const;
  /// The part that changed most since @p before, with its value then and now (for a run that fails).
  std::string fastest_growing(const EnergyLedger &before) const;
};
} // namespace kerf
