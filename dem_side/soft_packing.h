// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing.h"

#include <random>

namespace kerf::dem
{
/// Soft frictionless particles of mass 1 and contact stiffness 1 in a box with walls: the tool to make dense packings. Contact
/// energy is overlap^2 / 2. Only operations whose result does not depend on the machine are used (no vectorised sums, no libm
/// functions other than sqrt), so that a seed gives the same packing everywhere.
class SoftPacking
{
public:
  SoftPacking(int dim, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, Eigen::Matrix3Xd positions,
              std::vector<double> radii, double mean_radius);

  /// Particles have radii() = scale() * the radii of the constructor. May grow up to max_scale = 1.1.
  void set_scale(double scale) { m_scale = scale; }
  double scale() const { return m_scale; }

  /// Thermal motion while the scale grows from its value to @p final_scale and the temperature falls to zero: lets the
  /// particles find denser arrangements than a quench does. @p speed is the initial rms speed a direction in mean radii.
  void anneal(double final_scale, double speed, int steps, std::mt19937_64 &random,
              const std::function<void(double)> &progress);

  /// Minimises the energy (FIRE, Bitzek et al. 2006) until the rms force on a particle is below @p tolerance times the mean
  /// contact force, or no contact is left. @return steps used
  int minimise(double tolerance, int max_steps);

  double mean_overlap() const { return m_contacts ? m_overlap_sum / m_contacts / m_mean_radius : 0.; } ///< [mean radii]
  const Eigen::Matrix3Xd &positions() const { return m_positions; }
  Eigen::VectorXd radii() const;

  static constexpr double max_scale = 1.1;

private:
  void update_neighbours();
  double compute_forces(); ///< also counts contacts; @return sum of squared forces
  void move(double dt);

  int m_dim, m_size;
  Eigen::Vector3d m_lower, m_upper;
  double m_mean_radius, m_skin, m_largest = 0., m_scale = 1.;
  double m_overlap_sum = 0.;
  long m_contacts = 0;
  std::vector<double> m_radii;
  Eigen::Matrix3Xd m_positions, m_velocities, m_forces, m_positions_at_update;
  std::vector<std::array<int, 2>> m_neighbours;
};

/// Uniform in [0, 1), the same on every machine (the standard's distributions are not).
inline double uniform(std::mt19937_64 &random)
{
  return double(random() >> 11) * 0x1p-53;
}
} // namespace kerf::dem
