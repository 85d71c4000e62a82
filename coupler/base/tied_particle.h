// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <array>

namespace kerf
{
/// A particle that is tied to the finite elements.
struct TiedParticle
{
  int index = -1; ///< in the packing
  /// Load that the gradient of the weights puts on the particle, relative to one well inside the overlap [-]. It is one half on
  /// the border of the overlap, so that the particles of a lattice are a trapezoidal rule over the overlap. Beyond the border
  /// it is the small part that the bonds across the border carry.
  double share = 1.;
  std::array<bool, 3> blocked = {{false, false, false}}; ///< directions in which its boundary conditions hold it
};
} // namespace kerf
