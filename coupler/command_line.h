// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/commands/commands.h"

#include <mpi.h>
#include <string>
#include <vector>

namespace kerf
{
/// Runs kerf with @p arguments, the words after its name. Errors become one line on stderr and an exit code. An error on one
/// rank alone ends all of them. Collective.
Ending run_command_line(const std::vector<std::string> &arguments, MPI_Comm comm);
} // namespace kerf
