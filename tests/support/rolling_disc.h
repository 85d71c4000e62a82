// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/loading/tool/tool_settings.h"

namespace kerf::test
{
/// A disc of radius 2 above the origin that rolls to the right with a speed of 3.
/// @param width see ToolSettings
inline ToolSettings rolling_disc(double width)
{
  ToolSettings settings;
  settings.radius = 2.;
  settings.width = width;
  settings.path = {{0., Eigen::Vector3d(0., 2.45, 0.7)}, {1., Eigen::Vector3d(3., 2.45, 0.7)}};
  settings.smoothing_time = 0.;
  settings.rolling = true;
  return settings;
}
} // namespace kerf::test
