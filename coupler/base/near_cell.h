// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf
{
/// A cell whose outer surface a rigid body touches or is about to touch.
struct NearCell
{
  int cell = 0;
  double curvature_radius = 0.; ///< smallest one of the body's surface, infinite for a plane [m]
};
} // namespace kerf
