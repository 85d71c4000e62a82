// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"

#include <mpi.h>

namespace kerf
{
/// kerf calibrate: calibrates bond stiffnesses, then bond strengths by simulated tests, and writes them into the store. Throws
/// InputError when the strengths cannot be reached. The ranks share the tests. Collective.
int calibrate_case(const RunOptions &options, MPI_Comm comm);
} // namespace kerf
