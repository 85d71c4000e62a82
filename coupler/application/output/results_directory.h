// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <mpi.h>
#include <string>

namespace kerf
{
/// Makes @p directory ready for a run on the first rank; nothing of another run is lost: a directory that is not empty is an
/// InputError unless @p overwrite, and then only what kerf wrote is removed. Collective.
void prepare_results_directory(const std::string &directory, bool overwrite, MPI_Comm comm);

/// Throws the error of prepare_results_directory() without touching anything.
void check_results_directory(const std::string &directory, bool overwrite);
} // namespace kerf
