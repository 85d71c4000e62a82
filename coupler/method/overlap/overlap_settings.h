// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf
{
/// Course of the particles' weight across the overlap.
enum class WeightFunction
{
  linear,
  cubic,
  constant
};

struct OverlapSettings
{
  WeightFunction weight_function = WeightFunction::linear;
  double width = 0.; ///< L_o [m]
};
} // namespace kerf
