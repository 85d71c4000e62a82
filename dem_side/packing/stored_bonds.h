// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

#include <algorithm>
#include <vector>

namespace kerf::dem
{
/// The bonds of a packing by particle, to look up the partners of a particle.
class StoredBonds
{
public:
  explicit StoredBonds(const Packing &packing) : first_of(packing.size() + 1, 0), partners(2 * packing.bonds.size())
  {
    for (const auto &bond : packing.bonds)
      for (const int end : bond)
        ++first_of[end + 1];
    for (int i = 0; i < packing.size(); ++i)
      first_of[i + 1] += first_of[i];
    std::vector<std::size_t> next(first_of.begin(), first_of.end() - 1);
    for (const auto &bond : packing.bonds)
    {
      partners[next[bond[0]]++] = bond[1];
      partners[next[bond[1]]++] = bond[0];
    }
    for (int i = 0; i < packing.size(); ++i)
      std::sort(partners.begin() + first_of[i], partners.begin() + first_of[i + 1]);
  }

  struct Range
  {
    const int *first, *last;
    const int *begin() const { return first; }
    const int *end() const { return last; }
  };
  Range partners_of(int particle) const
  {
    return {partners.data() + first_of[particle], partners.data() + first_of[particle + 1]};
  }
  int count(int particle) const { return static_cast<int>(first_of[particle + 1] - first_of[particle]); }
  bool bonded(int a, int b) const { return std::binary_search(partners_of(a).first, partners_of(a).last, b); }

private:
  std::vector<std::size_t> first_of; ///< index of a particle's first partner
  std::vector<int> partners;         ///< ascending for each particle
};
} // namespace kerf::dem
