// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/generation/container.h"

#include <functional>
#include <memory>
#include <random>
#include <vector>

namespace kerf::dem
{
/// Generates dense packings: a LIGGGHTS instance of this rank alone moves soft frictionless particles of mass 1 and contact
/// stiffness 1 between walls, while their radii grow by a common scale. Lengths inside are in mean diameters.
class Compaction
{
public:
  /// @param container kept alive by the caller. @param mean_radius unit of lengths [m]
  Compaction(const Container &container, const Eigen::Matrix3Xd &positions, const std::vector<double> &radii,
             double mean_radius);
  ~Compaction();

  /// The radii are scale() times those of the constructor.
  void set_scale(double scale);
  double scale() const;

  /// Thermal motion while the scale grows to @p final_scale and the temperature falls to zero. The particles find denser
  /// arrangements than in a quench. @p speed is the initial rms speed per direction in mean radii per time unit, with mass and
  /// stiffness 1. @p progress is told the completed fraction.
  void anneal(double final_scale, double speed, int steps, std::mt19937_64 &random,
              const std::function<void(double)> &progress);

  /// Minimises the energy of the overlaps (FIRE, Bitzek et al. 2006) until the rms force on a particle is below @p tolerance
  /// times the mean contact force, or no contact remains. @p progress is told the fraction of max_steps. Throws
  /// std::runtime_error when particles were pushed out of the container. @return number of steps
  int minimise(double tolerance, int max_steps, const std::function<void(double)> &progress = {});

  double mean_overlap() const;        ///< of the contacts between particles, in mean radii; 0 without any
  Eigen::Matrix3Xd positions() const; ///< [m]
  Eigen::VectorXd radii() const;      ///< [m]

private:
  struct Engine;
  std::unique_ptr<Engine> engine;
};

/// Uniform in [0, 1), the same on every machine (the standard's distributions are not).
inline double uniform(std::mt19937_64 &random)
{
  return double(random() >> 11) * 0x1p-53;
}
} // namespace kerf::dem
