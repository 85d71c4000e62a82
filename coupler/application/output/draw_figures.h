// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <string>

namespace kerf
{
/// Draws the figures of a results directory with plots/figures.py, which belongs to the program, and the first python3 of PATH
/// that has the modules it needs. Says in one line on standard error why figures were not drawn. Does nothing for a directory
/// without history and stability maps. On one rank, after MPI has ended: it starts processes.
void draw_figures(const std::string &directory);
} // namespace kerf
