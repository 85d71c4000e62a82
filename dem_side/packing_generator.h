// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing.h"

namespace kerf::dem
{
/// Fills packing.lower .. packing.upper with a dense random packing, bonds it and drops loose particles; called by
/// generate_packing(), which checks the settings.
void generate_random(Packing &packing, const PackingSettings &settings, const Progress &progress);

/// Removes particles with fewer than two bonds (again and again) and everything not connected to the main body; a particle on
/// one bond can spin about it freely. Indices of bonds are renewed, the order of particles is kept.
/// @return removed fraction of the particles [-]
double remove_loose_particles(Packing &packing);
} // namespace kerf::dem
