// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/script/script_force.h"

#include <map>
#include <mpi.h>
#include <string>

/// LIGGGHTS as a program of its own that knows the rock bond.
namespace kerf::dem
{
/// Runs a LIGGGHTS input script with LIGGGHTS' arguments (-in FILE, -log, -screen, -var ...); argv[0] is not read. A script
/// with neither the rock bond nor one of the styles in @p forces runs as in stock LIGGGHTS, whose own errors end the program.
/// Errors of the rock bond are thrown on all ranks alike and written to the log file: std::invalid_argument when the script is
/// wrong, Unstable when the particles ran away. Collective.
void run_script(int argc, char **argv, MPI_Comm comm, const std::map<std::string, ScriptForceMaker> &forces);
} // namespace kerf::dem
