// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <vector>

namespace kerf::dem
{
/// How the ranks share an axis of the domain: slab k of [0, 1] lies between borders k and k + 1.
typedef std::vector<double> Borders;

/// Borders of slabs that hold equal numbers of points.
/// @param counts points in equal bins of [0, 1]
/// @param thinnest slab allowed; equal slabs if there is no room for that
Borders balanced_borders(const std::vector<double> &counts, int n_slabs, double thinnest);

/// Moves borders to @p wanted, but none past the old place of the next one: what lay in a slab stays there or comes to a
/// neighbour. No slab gets thinner than @p thinnest, if none was.
Borders approach(const Borders &borders, const Borders &wanted, double thinnest);

/// Points in the fullest slab by those in a mean one, with the same bins.
double imbalance(const std::vector<double> &counts, const Borders &borders);
} // namespace kerf::dem
