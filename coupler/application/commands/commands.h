// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"

#include <mpi.h>
#include <string>

namespace kerf
{
/// kerf run. Returns the exit code: 0, or 128 + signal after an interrupt with everything written. Collective.
int run_case(const RunOptions &options, MPI_Comm comm);

/// kerf check: validates, prints what a run would be. Collective.
int check_case(const RunOptions &options, MPI_Comm comm);

/// kerf pack: generates and calibrates the store. Collective.
int pack_case(const RunOptions &options, MPI_Comm comm);

/// kerf study stability: perturbs the case's overlap at many settings, each with one map of two parameters; writes
/// stability.csv. Collective.
int study_stability(const RunOptions &options, MPI_Comm comm);

/// Name and versions of kerf and its libraries, one a line.
std::string version_text();
} // namespace kerf
