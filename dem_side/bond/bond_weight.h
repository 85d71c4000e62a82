// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/stored_bonds.h"

#include <Eigen/Core>
#include <algorithm>
#include <vector>

namespace kerf::dem
{
/// Weights of particles in the bonds between them. A bond has the weight of its contact point, linear between its ends,
///   w_ij = (r_i w_i + r_j w_j)/(r_i + r_j),
/// and its branches share the distance like the radii times the weights. The torque on particle i is then w_i times that of the
/// bond without weights: wherever these balance, as in a body under uniform strain, they do so with any weights.
/// A particle of little weight has a short branch and would turn as it likes, so bonds resist that their ends turn apart; see
/// rolling_resistance(). Under uniform strain they do not.
/// @return radius times weight [m]; bonds of particles without weight have a contact point, too.
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

/// Stiffness against turning apart, over that of an unweighted bond against shear times its length squared [-]: with it
/// particles without weight are held as they would be at the end of half of the length.
inline double rolling_resistance(const BondEnd &first, const BondEnd &second)
{
  const double a = first.weighted * second.radius, b = second.weighted * first.radius;
  const double difference = (a - b) / (a + b);
  return 0.25 * difference * difference * bond_weight(first, second);
}

/// What a particle's mass is weighted by: the mean weight of its stored bonds to active particles, without any its own. (With
/// its own weight alone a particle at the end of the overlap would be too light for its bonds.)
/// @param active, @param weight by index in the packing
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
