// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"

#include <mpi.h>
#include <string>

namespace kerf
{
/// How a command ended.
struct Ending
{
  int code = 0;        ///< exit code of the program, see docs/user/errors.md
  std::string results; ///< directory whose figures are to be drawn; empty: none
  std::string failure; ///< one line for the user; empty: none
};

/// kerf run. Ends with code 0, with 3 when the run became unstable, or with 130 after an interrupt, when all output has been
/// written. Throws InputError. Collective.
Ending run_case(const RunOptions &options, MPI_Comm comm);

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
