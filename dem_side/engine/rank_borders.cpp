// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rank_borders.h"

#include <algorithm>
#include <numeric>

namespace kerf::dem
{
namespace
{
/// Points below a position on the axis, if points are distributed evenly in their bins.
double count_below(const std::vector<double> &counts, double place)
{
  const double at = place * static_cast<double>(counts.size());
  const auto bin = std::min(static_cast<std::size_t>(at), counts.size() - 1);
  return std::accumulate(counts.begin(), counts.begin() + bin, 0.) + (at - static_cast<double>(bin)) * counts[bin];
}

/// Moves inner borders up, then down, just enough to give every segment its smallest width.
void widen(Borders &borders, double thinnest)
{
  const std::size_t last = borders.size() - 1;
  for (std::size_t k = 1; k < last; ++k)
    borders[k] = std::max(borders[k], borders[k - 1] + thinnest);
  for (std::size_t k = last - 1; k > 0; --k)
    borders[k] = std::min(borders[k], borders[k + 1] - thinnest);
}
} // namespace

Borders balanced_borders(const std::vector<double> &counts, int n_segments, double thinnest)
{
  Borders borders(n_segments + 1);
  for (int k = 0; k <= n_segments; ++k)
    borders[k] = static_cast<double>(k) / n_segments;
  const double total = std::accumulate(counts.begin(), counts.end(), 0.);
  if (total <= 0. || n_segments * thinnest >= 1.)
    return borders;
  double below = 0.;
  std::size_t bin = 0;
  for (int k = 1; k < n_segments; ++k)
  {
    const double target = total * k / n_segments;
    while (below + counts[bin] < target)
      below += counts[bin++];
    borders[k] = (static_cast<double>(bin) + (target - below) / counts[bin]) / static_cast<double>(counts.size());
  }
  widen(borders, thinnest);
  return borders;
}

Borders approach(const Borders &borders, const Borders &target, double thinnest)
{
  Borders result = borders;
  for (std::size_t k = 1; k + 1 < borders.size(); ++k)
    result[k] = std::clamp(target[k], borders[k - 1] + thinnest, borders[k + 1] - thinnest);
  widen(result, thinnest);
  return result;
}

double imbalance(const std::vector<double> &counts, const Borders &borders)
{
  double fullest = 0.;
  for (std::size_t k = 0; k + 1 < borders.size(); ++k)
    fullest = std::max(fullest, count_below(counts, borders[k + 1]) - count_below(counts, borders[k]));
  const double total = std::accumulate(counts.begin(), counts.end(), 0.);
  return total > 0. ? fullest * static_cast<double>(borders.size() - 1) / total : 1.;
}
} // namespace kerf::dem
