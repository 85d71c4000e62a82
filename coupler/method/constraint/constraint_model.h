// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint_settings.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "dem_side/dem_side.h"

#include <mpi.h>

namespace kerf
{
/// What a constraint is made from.
struct ConstraintModel
{
  ConstraintSettings settings;
  OverlapSettings overlap;
  double k_n = 0., k_t = 0.;             ///< of the bonds [N/m], 2D per metre
  double mean_diameter = 0.;             ///< d of the particles [m]
  const dem::Packing *packing = nullptr; ///< outlives the constraint
  MPI_Comm comm = MPI_COMM_WORLD;
};
} // namespace kerf
