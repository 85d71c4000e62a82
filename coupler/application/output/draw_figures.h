// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <string>

namespace kerf
{
/// Draws the figures of a results directory with plots/figures.py and the first python3 in PATH that has the required modules.
/// If the figures cannot be drawn, one line on standard error gives the reason. A directory without history and stability maps
/// is ignored. To be called on one rank after MPI has ended, since it starts processes. @param detached returns at once and
/// lets the figures survive this program: mpirun kills its ranks one second after a signal.
void draw_figures(const std::string &directory, bool detached = false);
} // namespace kerf
