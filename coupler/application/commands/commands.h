// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"

#include <mpi.h>
#include <string>

namespace kerf
{
/// kerf run. Returns the exit code: 0, or 128 + signal after an interrupt, when all output has been written. Throws InputError
/// and UnstableRun. Collective.
int run_case(const RunOptions &options, MPI_Comm comm);

/// kerf check: validates the case and prints size, time step and estimated cost of a run. Throws InputError. Collective.
int check_case(const RunOptions &options, MPI_Comm comm);

/// kerf pack: generates and calibrates the store. Throws InputError. Collective.
int pack_case(const RunOptions &options, MPI_Comm comm);

/// kerf study stability: perturbs the overlap of the case with noise, for maps of two parameters each, and writes
/// stability.csv. Collective.
int study_stability(const RunOptions &options, MPI_Comm comm);

/// Names and versions of kerf and its libraries, one in each line.
std::string version_text();
} // namespace kerf
