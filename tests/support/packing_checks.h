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

/// Settings of a triangular lattice of discs of 2 mm in a box of the given sides [mean diameters].
inline PackingSettings triangular(double width, double height)
{
  PackingSettings settings;
  settings.kind = "triangular";
  settings.mean_diameter = 2e-3;
  settings.lower = {-1e-2, 5e-3, 0.};
  settings.upper = settings.lower + Eigen::Vector3d(width, height, 0.) * settings.mean_diameter;
  return settings;
}

/// Equal discs at the given centres [m], without bonds.
inline Packing from_points(const std::vector<Eigen::Vector3d> &points, double radius)
{
  Packing packing;
  packing.positions.resize(3, points.size());
  for (std::size_t i = 0; i < points.size(); ++i)
    packing.positions.col(i) = points[i];
  packing.radii.setConstant(points.size(), radius);
  return packing;
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
