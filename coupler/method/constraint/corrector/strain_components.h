// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/exchange/simd.h"

namespace kerf
{
/// Components of a strain in Voigt notation. Shear components are angles, twice those of the tensor.
template <int dim>
struct StrainComponents;
template <>
struct StrainComponents<2>
{
  static constexpr int n = 3;
  static constexpr int axes[n][2] = {{0, 0}, {1, 1}, {0, 1}};
  typedef SimdLanes Vector; ///< three components and an unused lane
};
template <>
struct StrainComponents<3>
{
  static constexpr int n = 6;
  static constexpr int axes[n][2] = {{0, 0}, {1, 1}, {2, 2}, {1, 2}, {0, 2}, {0, 1}};
  typedef SimdPack Vector;
};
} // namespace kerf
