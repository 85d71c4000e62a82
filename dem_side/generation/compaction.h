// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/generation/container.h"

#include <functional>
#include <memory>
#include <random>
#include <vector>

namespace kerf::dem
{
/// Soft frictionless particles of mass 1 and contact stiffness 1 between walls, moved by a LIGGGHTS instance of this rank
/// alone: the tool to make dense packings. The radii grow by a common scale. Lengths inside are in mean diameters, so any unit
/// will do.
class Compaction
{
public:
  /// @param container kept alive by the caller. @param mean_radius unit of lengths [m]
  Compaction(const Container &container, const Eigen::Matrix3Xd &positions, const std::vector<double> &radii,
             double mean_radius);
  ~Compaction();

  /// Particles have scale() times the radii of the constructor.
  void set_scale(double scale);
  double scale() const;

  /// Thermal motion while the scale grows from its value to @p final_scale and the temperature falls to zero: lets the
  /// particles find denser arrangements than a quench does. @p speed is the initial rms speed a direction in mean radii a time
  /// unit (the mass and the stiffness are 1).
  void anneal(double final_scale, double speed, int steps, std::mt19937_64 &random,
              const std::function<void(double)> &progress);

  /// Minimises the energy of the overlaps (FIRE, Bitzek et al. 2006) until the rms force on a particle is below @p tolerance
  /// times the mean contact force, or no contact is left. @p progress is told the share of max_steps. @return steps used
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
