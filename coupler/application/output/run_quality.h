// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/coupled_model.h"

#include <string>
#include <vector>

namespace kerf
{
/// Broken bonds at one kind of place.
struct DamageCount
{
  std::int64_t bonds = 0;
  Eigen::Vector3d place = Eigen::Vector3d::Zero(); ///< mean of the contact points [m]
};

/// Figures of a run that tell whether its model or a detail of the method rules the result.
struct RunFigures
{
  std::int64_t broken = 0; ///< bonds
  DamageCount early;       ///< broke in the overlap, or within one check interval of the activation of a particle
  DamageCount at_border;   ///< have an end in the overlap now
  EnergyLedger energy;
  double turnover = 0.; ///< largest so far, see EnergyLedger::turnover() [J]
};

/// One line for each figure beyond its limit (theory, built-in numbers); docs/user/errors.md says how to act on it.
std::vector<std::string> warnings(const RunFigures &figures);

/// Follows the broken bonds of a run.
class DamageWatch
{
public:
  /// Particles that are active now count as old. @p model is kept. @param check_interval of the activation [steps]
  DamageWatch(const CoupledModel &model, int check_interval, MPI_Comm comm);
  /// To be called after every block of steps, before cells are converted. Not collective.
  void look();
  /// Broken bonds until the last look. Collective.
  RunFigures figures() const;

private:
  const CoupledModel &model;
  std::int64_t check_interval;
  MPI_Comm comm;
  std::vector<std::int64_t> activated_at; ///< step, by index in the packing; never: not active yet
  std::int64_t looked_at = 0;             ///< step
  int active_seen = 0;
  std::size_t n_seen = 0; ///< broken bonds of this rank
  DamageCount early;      ///< of this rank, with the sum of the places
};
} // namespace kerf
