// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

#include <stdexcept>
#include <string>
#include <vector>

/// What tests of packings ask.
namespace kerf::dem::test
{
/// Bonds of each particle.
inline std::vector<int> partners(const Packing &packing)
{
  std::vector<int> count(packing.size(), 0);
  for (const auto &[i, j] : packing.bonds)
  {
    ++count[i];
    ++count[j];
  }
  return count;
}

/// What generate_packing() says of settings that it does not take.
inline std::string error_of(const PackingSettings &settings)
{
  try
  {
    generate_packing(settings);
  }
  catch (const std::invalid_argument &error)
  {
    return error.what();
  }
  return "no error";
}
} // namespace kerf::dem::test
