// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <array>

namespace kerf
{
/// A particle that is tied to the finite elements, and how much of it: the load that the change of the weights puts on it,
/// relative to a particle well inside the overlap. On the border of the overlap that is one half, so that the particles of a
/// lattice are a trapezoidal rule over the overlap; beyond it is as little as their bonds across the border carry.
struct TiedParticle
{
  int index = -1; ///< in the packing
  double share = 1.;
  std::array<bool, 3> blocked = {{false, false, false}}; ///< directions in which its boundary conditions hold it
};
} // namespace kerf
