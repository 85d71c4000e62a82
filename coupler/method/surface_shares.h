// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/loading/boundary/tributary_areas.h"
#include "coupler/method/overlap/overlap.h"

#include <utility>
#include <vector>

namespace kerf
{
/// Keeps the particles' shares of surface loads complementary to those of the finite elements, wherever the overlap is: each
/// point of a face has the weight 1 - alpha there. Theory (9.14).
class SurfaceShares
{
public:
  explicit SurfaceShares(Overlap &overlap) : overlap(overlap) {}

  /// Adds faces whose shares are kept, by reference. Call it before the first conversion.
  void add(TributaryAreas &areas) { all.emplace_back(&areas, overlap.add_points(areas.points())); }
  /// Sets the shares of all faces. @param full the particles carry the whole load, as while they relax with full weights.
  /// Returns false if nothing has changed since the last call.
  bool update(bool full);

private:
  Overlap &overlap;
  std::vector<std::pair<TributaryAreas *, int>> all; // with the number of their points in the overlap
  std::pair<int, bool> valid_for{-1, false};         // changes of the overlap, full weights
};
} // namespace kerf
