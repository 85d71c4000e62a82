// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/stored_bonds.h"

#include <Eigen/Core>
#include <algorithm>
#include <vector>

/// Weights of particles in the bonds between them. A bond has the weight of its contact point, interpolated linearly between
/// its ends,
///   w_ij = (r_i w_i + r_j w_j)/(r_i + r_j).
/// Its branches divide the distance in the ratio of radius times weight. The torque of the bond on particle i is then w_i times
/// that of the bond without weights. Torques that balance without weights, as in a body under uniform strain, therefore balance
/// with any weights. Theory (4.6), (4.9).
/// A particle of little weight has a short branch, so shear hardly resists its rotation. Weighted bonds therefore also resist
/// the relative rotation of their ends, see rolling_resistance(). Under uniform strain there is no relative rotation.
namespace kerf::dem
{
/// @return radius times weight [m], never zero, so that a bond between particles without weight still has a contact point.
inline double weighted_radius(double radius, double weight)
{
  constexpr double nothing = 1e-12;
  return radius * std::max(weight, nothing);
}

struct BondEnd
{
  double radius;   ///< [m]
  double weighted; ///< weighted_radius() [m]
};
inline BondEnd bond_end(double radius, double weight)
{
  return {radius, weighted_radius(radius, weight)};
}

inline double bond_weight(const BondEnd &first, const BondEnd &second)
{
  return (first.weighted + second.weighted) / (first.radius + second.radius);
}

/// Stiffness of the bond against relative rotation of its ends, divided by its unweighted shear stiffness times its length
/// squared [-]. It holds a particle without weight as a shear spring with a branch of half of the length would.
/// Theory (4.10).
inline double rolling_resistance(const BondEnd &first, const BondEnd &second)
{
  const double a = first.weighted * second.radius, b = second.weighted * first.radius;
  const double difference = (a - b) / (a + b);
  return 0.25 * difference * difference * bond_weight(first, second);
}

/// Weight of a particle's mass [-]: the mean weight of its stored bonds to active particles, or its own weight without any such
/// bond. With its own weight alone, a particle at the end of the overlap would be too light for its bonds and raise the largest
/// frequency.
/// Theory (4.8). @p active, @p weight by index in the packing
inline double mass_weight(int particle, const Packing &packing, const StoredBonds &stored_bonds,
                          const std::vector<char> &active, const Eigen::VectorXd &weight)
{
  const BondEnd end = bond_end(packing.radii[particle], weight[particle]);
  double sum = 0.;
  int n = 0;
  for (const int j : stored_bonds.partners_of(particle))
    if (active[j])
    {
      sum += bond_weight(end, bond_end(packing.radii[j], weight[j]));
      ++n;
    }
  return n > 0 ? sum / n : weight[particle];
}
} // namespace kerf::dem
