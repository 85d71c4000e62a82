// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <vector>

namespace kerf::fem
{
/// One axis of a structured box mesh. All lengths in [m].
struct GradedAxis
{
  double lower = 0.;
  double upper = 0.;
  double cell_size = 0.;  ///< size in the fine zone
  double fine_lower = 0.; ///< fine zone; fine_lower == fine_upper: uniform axis
  double fine_upper = 0.;
  double growth = 1.;            ///< largest ratio of neighbouring cells outside the fine zone
  double largest_cell_size = 0.; ///< bound of the graded size; 0: none
};

/// Vertex coordinates from lower to upper, both included exactly [m]. The fine zone is rounded to whole cells of about
/// cell_size. A remainder too short to be graded joins the fine zone, so that no thin cell governs the stable step.
std::vector<double> vertex_coordinates(const GradedAxis &axis);
} // namespace kerf::fem
