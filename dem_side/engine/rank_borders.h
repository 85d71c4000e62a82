// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <vector>

namespace kerf::dem
{
/// How the ranks share an axis of the domain: segment k of [0, 1] lies between borders k and k + 1.
typedef std::vector<double> Borders;

/// Borders of segments that hold equal numbers of points.
/// @param counts points in equal bins of [0, 1]
/// @param thinnest segment allowed; equal segments if there is no room for that
Borders balanced_borders(const std::vector<double> &counts, int n_segments, double thinnest);

/// Moves borders to @p target, but none past the old place of the next one: what lay in a segment stays there or comes to a
/// neighbour. No segment gets thinner than @p thinnest, if none was.
Borders approach(const Borders &borders, const Borders &target, double thinnest);

/// Points in the fullest segment by those in a mean one, with the same bins.
double imbalance(const std::vector<double> &counts, const Borders &borders);
} // namespace kerf::dem
