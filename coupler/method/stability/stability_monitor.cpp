// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/stability_monitor.h"

#include "coupler/base/errors.h"
#include "coupler/method/stability/stable_step.h"

#include <sstream>

namespace kerf
{
void StabilityMonitor::check(const fem::FemSide &fem, const Overlap &overlap, const std::vector<TiedParticle> &tied,
                             const std::vector<char> &active, const std::vector<int> &cells, double dt, Constraint &constraint)
{
  // The Lanczos value is a lower bound. Six products from the mode of the previous conversion gave at least 0.7 of the value of
  // 200 products (2D and 3D cuts, penalty and multipliers). So a value below half of the limit needs no further products.
  constexpr int few = 6, many = 30;
  // Local damping adds its share of all forces to them. Theory (8.11).
  const double limit = 4. / (1. + settings.local_damping), near = 0.5 * limit;
  auto now =
    std::make_unique<CoupledOperator>(bond_material(settings, packing), constraint, fem, packing, overlap, tied, active,
                                      part_around(fem.mesh(), cells, reach_of_overlap(settings, constraint)), comm);
  if (last)
    now->take_mode(*last);
  double highest = now->highest(dt, 1e-2, few);
  if (highest > near)
    highest = now->highest(dt, 1e-2, many);
  last = std::move(now);
  if (highest > limit)
  {
    const double stable = last->stable_step(dt, limit);
    std::ostringstream text;
    text << "the coupled model is unstable at the time step " << dt << " s: the stable step around the cells converted last is "
         << stable << " s; lower Time/Safety, Coupling/Penalty ratio or damping";
    throw UnstableRun(text.str());
  }
}
} // namespace kerf
