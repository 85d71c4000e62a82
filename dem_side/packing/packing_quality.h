// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

namespace kerf::dem
{
/// Geometry of a packing as numbers a person can judge it by. The core is what lies more than three mean diameters inside
/// of the sides (of a closed surface: of the largest cube inside).
PackingQuality measure_quality(const Packing &packing);
} // namespace kerf::dem
