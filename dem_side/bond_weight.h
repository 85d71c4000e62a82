// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>

namespace kerf::dem
{
/// Weights of particles in the bonds between them. A bond has the weight of its contact point, linear between its ends,
///   w_ij = (r_i w_i + r_j w_j)/(r_i + r_j),
/// and its branches share the distance like the radii times the weights. The torque on particle i is then w_i times that of the
/// bond without weights: wherever these balance, as in a body under uniform strain, they do so with any weights.
/// A particle of little weight has a short branch and would turn as it likes, so bonds resist that their ends turn apart; see
/// bond_rolling(). Under uniform strain they do not.
/// @return radius times weight [m]; bonds of particles without weight have a contact point, too.
inline double weighted_radius(double radius, double weight)
{
  constexpr double nothing = 1e-12;
  return radius * std::max(weight, nothing);
}

inline double bond_weight(double weighted_first, double weighted_second, double radius_first, double radius_second)
{
  return (weighted_first + weighted_second) / (radius_first + radius_second);
}

/// Stiffness against turning apart, over that of an unweighted bond against shear times its length squared [-]: with it
/// particles without weight are held as they would be at the end of half of the length.
inline double bond_rolling(double weighted_first, double weighted_second, double radius_first, double radius_second)
{
  const double first = weighted_first * radius_second, second = weighted_second * radius_first;
  const double difference = (first - second) / (first + second);
  return 0.25 * difference * difference * bond_weight(weighted_first, weighted_second, radius_first, radius_second);
}
} // namespace kerf::dem
