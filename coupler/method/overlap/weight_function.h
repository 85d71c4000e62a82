// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/overlap/overlap_settings.h"

#include <algorithm>

namespace kerf
{
/// FE weight alpha [-] at distance @p phi [m] from the particle region, for an overlap of width @p width [m]. It is 0 in the
/// particle region and 1 beyond the overlap. The DE weight is 1 - alpha. Linear weights: Xiao & Belytschko 2004; cubic and
/// constant weights: Bauman et al. 2008. Theory (4.2).
inline double fe_weight(WeightFunction function, double phi, double width)
{
  if (phi <= 0.)
    return 0.;
  if (phi >= width)
    return 1.;
  const double s = phi / width;
  switch (function)
  {
  case WeightFunction::cubic:
    return s * s * (3. - 2. * s);
  case WeightFunction::constant:
    return 0.5;
  default:
    return s;
  }
}
} // namespace kerf
