// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <mpi.h>
#include <string>

namespace kerf
{
/// Prepares @p directory for a run on the first rank. Throws InputError when it is not empty and @p overwrite is false. With @p
/// overwrite only files that kerf wrote are removed. Collective.
void prepare_results_directory(const std::string &directory, bool overwrite, MPI_Comm comm);

/// Throws the errors of prepare_results_directory() without changing any file.
void check_results_directory(const std::string &directory, bool overwrite);
} // namespace kerf
