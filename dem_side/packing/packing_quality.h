// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

namespace kerf::dem
{
/// Measures the quality of a packing. Its core are the particles more than three mean diameters inside of its sides, or of the
/// sides of the largest cube inside of a closed surface.
PackingQuality measure_quality(const Packing &packing);
} // namespace kerf::dem
