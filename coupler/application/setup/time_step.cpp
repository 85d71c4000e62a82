// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/time_step.h"

#include "coupler/base/errors.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace kerf
{
namespace
{
/// Steps of a run; their number stays exact, and no machine does as many in a year.
constexpr double most_steps = 1e12;

/// Throws an InputError with the reason why the constraint refuses the case.
void check_refusal(Refusal refusal, const Case &settings, const fem::FemSide &fem)
{
  const std::string case_path = settings.directory + "/case.prm";
  const std::string ratio = case_path + ": Coupling/Penalty ratio = " + std::to_string(settings.constraint.penalty_ratio) +
                            " is unstable at any time step ";
  switch (refusal)
  {
  case Refusal::none:
    return;
  case Refusal::ratio_too_large:
    throw InputError(ratio + "with Coupling/Method = " + settings.constraint.method + ", give less than 2");
  case Refusal::unstable_overlap:
    throw InputError(ratio + "in this overlap, give a smaller value");
  case Refusal::too_much_damping:
    throw InputError(case_path +
                     ": Bond/Local damping, Coupling/Interface damping and Coupling/Penalty ratio together leave no "
                     "stable time step, give a smaller value of one of them");
  case Refusal::cells_too_fine:
    throw InputError(case_path + ": Mesh/Cell size: the smallest cells have edges of " +
                     std::to_string(smallest_edge(fem.mesh()) / settings.packing.mean_diameter) +
                     " particle diameters, too few particles for means around nodes; give at least 1.5, or another "
                     "Coupling/Method than " +
                     settings.constraint.method);
  }
}
} // namespace

double choose_time_step(const Case &settings, Mode mode, const StableSteps &stable, const fem::FemSide &fem)
{
  check_refusal(stable.refusal, settings, fem);
  if (settings.time_step > stable.coupled)
  {
    std::ostringstream text;
    text << settings.directory << "/case.prm: Time/Time step = " << settings.time_step << " s is above the stable step "
         << stable.coupled << " s of mode " << name_of(mode) << " (finite elements " << stable.fem << " s, particles "
         << stable.dem
         << " s before Bond/Local damping, the dashpots of unequal pairs and the tool's contact lower it); give a "
         << "smaller step, or 0 for Time/Safety x stable step";
    throw InputError(text.str());
  }
  const double dt = settings.time_step > 0. ? settings.time_step : std::min(settings.safety * stable.reference, stable.coupled);
  if (const double steps = settings.end_time / dt; !(steps <= most_steps))
  {
    std::ostringstream text;
    text << settings.directory << "/case.prm: Time/End time = " << settings.end_time << " s are " << steps << " steps of " << dt
         << " s, the most are " << most_steps;
    throw InputError(text.str());
  }
  return dt;
}

std::int64_t number_of_steps(double end_time, double dt)
{
  constexpr double round_off = 1e-9; // of a step, or relative where numbers of steps are large
  const double steps = end_time / dt;
  return std::max<std::int64_t>(1, std::llround(std::ceil(steps - std::max(round_off, 1e-14 * steps))));
}
} // namespace kerf
