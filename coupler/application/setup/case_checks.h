// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"

#include <string>
#include <vector>

namespace kerf
{
/// Throws InputError for settings that contradict each other or cannot act on this mesh. docs/user/errors.md lists them.
void check_settings(const Case &settings, Mode mode, const fem::Mesh &mesh);

/// Throws InputError for a boundary condition on a side of the mesh that the body of Packing/Surface does not reach.
void check_conditions_on_surface(const Case &settings, const fem::Mesh &mesh, const dem::Packing &packing);

/// Settings that are possible, but probably not meant: a line for each. docs/user/errors.md lists them.
std::vector<std::string> doubts(const Case &settings, Mode mode, const fem::Mesh &mesh);
} // namespace kerf
