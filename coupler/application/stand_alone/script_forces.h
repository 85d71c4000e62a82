// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/script/stand_alone.h"

#include <mpi.h>

namespace kerf
{
/// Forces in scripts of kerf export that are not part of LIGGGHTS, by the name of the fix:
///
///   kerf/tool case DIR k_n K             the tool of DIR/case.prm; f_NAME[1..3]: force of the rock on the tool [N],
///                                        f_NAME[4]: its power on the rock [W]
///   kerf/dashpot normal X Y Z Z_p P Z_s S areas FILE
///                                        absorbing boundary: -a (P v_n + S v_t), P, S in Pa s/m, on the particles whose tags
///                                        and areas a [m^2], in two dimensions [m], are the lines of FILE
const std::map<std::string, dem::ScriptForceMaker> &script_forces();

/// kerf liggghts: a LIGGGHTS input script with the rock bond and the forces of kerf export. @param argv arguments of LIGGGHTS
/// after the name of the program. Collective.
int run_liggghts(int argc, char **argv, MPI_Comm comm);
} // namespace kerf
