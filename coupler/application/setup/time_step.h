// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/method/stability/stable_step.h"

#include <cstdint>

namespace kerf
{
/// The time step of a run [s]: Time/Time step, or Time/Safety times the stable step. Throws InputError when the given step is
/// above the stable one or when the constraint has no stable step. The StabilityMonitor checks it again after each conversion.
double choose_time_step(const Case &settings, Mode mode, const StableSteps &stable, const fem::FemSide &fem);

/// Steps of @p dt up to the end: the next whole number, but for the round-off of the quotient; at least one.
std::int64_t number_of_steps(double end_time, double dt);
} // namespace kerf
