// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/stability/coupled_operator.h"

#include <memory>
#include <vector>

namespace kerf
{
/// Follows the highest mode of the weighted, constrained model around the cells that were converted last.
class StabilityMonitor
{
public:
  StabilityMonitor(const Case &settings, const dem::Packing &packing, MPI_Comm comm)
    : settings(settings), packing(packing), comm(comm)
  {
  }
  /// After @p cells were converted: throws UnstableRun when no step as large as @p dt [s] is stable any more. Collective.
  void check(const fem::FemSide &fem, const Overlap &overlap, const std::vector<TiedParticle> &tied,
             const std::vector<char> &active, const std::vector<int> &cells, double dt, Constraint &constraint);

private:
  const Case &settings;
  const dem::Packing &packing;
  MPI_Comm comm;
  std::unique_ptr<CoupledOperator> last;
};
} // namespace kerf
