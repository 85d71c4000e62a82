// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/particle_types.h"

#include <functional>
#include <memory>
#include <mpi.h>
#include <string>
#include <vector>

namespace kerf::dem
{
/// External forces that a line `fix NAME all STYLE arguments...` of a LIGGGHTS script adds in each step.
class ScriptForce
{
public:
  virtual ~ScriptForce() = default;

  /// Called like a ForceHook. @param particles of this rank; without the rock bond their weight is 1 and rotation is null
  /// @param time of the positions [s]; @param dt step [s]
  virtual void apply(Phase phase, Particles &particles, double time, double dt) = 0;

  virtual int n_values() const { return 0; }
  /// Values that the script reads as f_NAME[1], f_NAME[2], ... Collective.
  virtual std::vector<double> values() const { return {}; }
};

/// Makes the force from the words after STYLE. Throws std::exception with a text of one line.
using ScriptForceMaker = std::function<std::unique_ptr<ScriptForce>(const std::vector<std::string> &arguments, MPI_Comm comm)>;
} // namespace kerf::dem
