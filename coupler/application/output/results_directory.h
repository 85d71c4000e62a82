// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <mpi.h>
#include <string>

namespace kerf
{
/// Makes @p directory ready for results, on the first rank: removes the results in it and leaves the mark of results. Throws
/// the errors of check_results_directory(). Collective.
void prepare_results_directory(const std::string &directory, const std::string &case_directory, bool overwrite, MPI_Comm comm);

/// Throws InputError when results may not be written to @p directory. Changes no file. It may not be the case or hold it. It
/// must be new or empty, or hold results that kerf marked as its own, and then only with @p overwrite.
void check_results_directory(const std::string &directory, const std::string &case_directory, bool overwrite);
} // namespace kerf
