// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"

#include <mpi.h>

namespace kerf
{
/// kerf calibrate: elastic part, then bond strengths from simulated tests, into the store. Collective; ranks share the tests.
int calibrate_case(const RunOptions &options, MPI_Comm comm);
} // namespace kerf
