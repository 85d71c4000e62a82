// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"

namespace kerf
{
/// What the finite elements of a case are set up with.
fem::Settings fem_settings(const Case &settings, MPI_Comm comm);
} // namespace kerf
