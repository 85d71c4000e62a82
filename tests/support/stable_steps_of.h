// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/coupled_model.h"
#include "coupler/method/stability/stable_step.h"

namespace kerf::test
{
/// Stable steps of a model with a constraint of its own. Collective.
inline StableSteps stable_steps_of(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing)
{
  const auto constraint = make_constraint(constraint_model(settings, packing, MPI_COMM_WORLD));
  return stable_steps(settings, mode, fem, packing, *constraint, MPI_COMM_WORLD);
}
} // namespace kerf::test
