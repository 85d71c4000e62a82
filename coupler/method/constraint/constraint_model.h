// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint_settings.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "dem_side/dem_side.h"

#include <mpi.h>

namespace kerf
{
/// Parameters from which a constraint is made.
struct ConstraintModel
{
  ConstraintSettings settings;
  OverlapSettings overlap;
  double k_n = 0., k_t = 0.;             ///< stiffnesses of the bonds [N/m] (2D: per metre)
  double mean_diameter = 0.;             ///< mean particle diameter d [m]
  const dem::Packing *packing = nullptr; ///< must outlive the constraint
  MPI_Comm comm = MPI_COMM_WORLD;
};
} // namespace kerf
