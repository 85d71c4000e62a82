// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf
{
/// Variation of the weights across the overlap.
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
