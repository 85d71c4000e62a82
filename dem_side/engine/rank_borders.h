// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <vector>

namespace kerf::dem
{
/// Division of an axis of the domain among the ranks: segment k of [0, 1] lies between borders k and k + 1.
typedef std::vector<double> Borders;

/// Borders of segments that hold equal numbers of points.
/// @param counts points in equal bins of [0, 1]
/// @param thinnest allowed segment; if not all segments fit, they are equal
Borders balanced_borders(const std::vector<double> &counts, int n_segments, double thinnest);

/// Moves borders towards @p target, but none past the old position of the next one: points of a segment stay in it or move to a
/// neighbouring segment. No segment gets thinner than @p thinnest, if none was.
Borders approach(const Borders &borders, const Borders &target, double thinnest);

/// Points in the fullest segment over the mean of all segments, with the same bins.
double imbalance(const std::vector<double> &counts, const Borders &borders);
} // namespace kerf::dem
