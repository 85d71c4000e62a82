// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/surface_shares.h"

namespace kerf
{
bool SurfaceShares::update(const bool full)
{
  const std::pair<int, bool> wanted{overlap.n_changes(), full};
  if (wanted == valid_for)
    return false;
  valid_for = wanted;
  std::vector<char> bears_loads(overlap.de_weights().size());
  for (std::size_t i = 0; i < bears_loads.size(); ++i)
    bears_loads[i] = overlap.de_weights()[i] > 0.;
  for (const auto &[areas, points] : all)
    if (full)
      areas->set_whole();
    else
      areas->set_weights(1. - overlap.fe_weights_at(points).array(), bears_loads);
  return true;
}
} // namespace kerf
