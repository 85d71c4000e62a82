// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

/// LIGGGHTS as a program of its own that knows the rock bond.
namespace kerf::dem
{
/// Outer forces that a line `fix NAME all STYLE arguments...` of a script adds in each step.
class ScriptForce
{
public:
  virtual ~ScriptForce() = default;

  /// Called like a ForceHook. @param particles of this rank; without the rock bond their weight is 1 and rotation is null
  /// @param time of the positions [s]; @param dt step [s]
  virtual void apply(Phase phase, Particles &particles, double time, double dt) = 0;

  virtual int n_values() const { return 0; }
  /// What the script sees as f_NAME[1], f_NAME[2], ... Collective.
  virtual std::vector<double> values() const { return {}; }
};

/// Makes the force out of what follows STYLE in the line. Throws std::exception with one line.
using ScriptForceMaker = std::function<std::unique_ptr<ScriptForce>(const std::vector<std::string> &arguments, MPI_Comm comm)>;

/// Runs an input script: the arguments are those of LIGGGHTS (-in FILE, -log, -screen, -var ...), argv[0] is not read.
/// A script without the rock bond and without the styles in @p forces does what it does in stock LIGGGHTS, whose own errors
/// end the program. Errors of the rock bond are thrown as std::exception, on all ranks alike, and are in the log file.
/// Collective.
void run_script(int argc, char **argv, MPI_Comm comm, const std::map<std::string, ScriptForceMaker> &forces);
} // namespace kerf::dem
