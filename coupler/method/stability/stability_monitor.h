// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/stability/coupled_operator.h"

#include <memory>
#include <vector>

namespace kerf
{
/// Monitors the highest eigenvalue of the weighted, constrained model around the cells of the last conversion. Theory (8.1).
class StabilityMonitor
{
public:
  StabilityMonitor(const ModelSettings &settings, const dem::Packing &packing, MPI_Comm comm)
    : settings(settings), packing(packing), comm(comm)
  {
  }
  /// To be called after @p cells were converted. Throws UnstableRun when the time step @p dt [s] is not stable. Collective.
  void check(const fem::FemSide &fem, const Overlap &overlap, const std::vector<TiedParticle> &tied,
             const std::vector<char> &active, const std::vector<int> &cells, double dt, Constraint &constraint);

private:
  const ModelSettings &settings;
  const dem::Packing &packing;
  MPI_Comm comm;
  std::unique_ptr<CoupledOperator> last;
};
} // namespace kerf
