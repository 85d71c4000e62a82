// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/simd.h"
#include "dem_side/dem_side.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

/// The rock bond and the contact it leaves, as pure functions of one pair. No particle engine in here.
///
/// The bond is elastic and perfectly brittle with one normal and one tangential spring (Onate & Rojek, CMAME 193, 2004,
/// sec. 2; Rojek et al., IJSS 49, 2012). It is written in total form: every force is a derivative of the potential
///   U = k_n u_n^2 / 2 + k_t |u_t|^2 / 2
/// of the present positions and rotations, so nothing drifts and the pair conserves momentum, angular momentum and energy.
/// For small strains that is the incremental law of the papers.
///
/// Real is double or Lanes, several pairs at once; what has branches is for double only.
namespace kerf::dem::law
{
namespace detail
{
template <int dim, typename Real>
struct Types
{
  using Vector = Eigen::Matrix<Real, dim, 1>;
  using Spin = Eigen::Matrix<Real, dim == 2 ? 1 : 3, 1>;
};
} // namespace detail
// Not deduced from arguments: an expression of Eigen is welcome where a vector is asked for.
template <int dim, typename Real = double>
using Vector = typename detail::Types<dim, Real>::Vector;
/// Rotation rates and moments: one component in two dimensions.
template <int dim, typename Real = double>
using Spin = typename detail::Types<dim, Real>::Spin;

/// Turned by 90 degrees. Composed of its components, the vector would be stored in two halves and read as one, which stalls.
inline Vector<2> quarter_turn(const Vector<2> &a)
{
  alignas(16) static constexpr double signs[2] = {-1., 1.};
  return a.reverse().cwiseProduct(Vector<2>::MapAligned(signs));
}
inline Vector<2, Lanes> quarter_turn(const Vector<2, Lanes> &a)
{
  return {-a.y(), a.x()};
}
template <typename Real>
[[gnu::always_inline]] inline Spin<2, Real> cross(const Eigen::Matrix<Real, 2, 1> &a, const Eigen::Matrix<Real, 2, 1> &b)
{
  return Spin<2, Real>(a.x() * b.y() - a.y() * b.x());
}
template <typename Real>
[[gnu::always_inline]] inline Vector<2, Real> cross(const Eigen::Matrix<Real, 1, 1> &w, const Eigen::Matrix<Real, 2, 1> &a)
{
  return w[0] * quarter_turn(a);
}
template <typename Real>
[[gnu::always_inline]] inline Vector<3, Real> cross(const Eigen::Matrix<Real, 3, 1> &a, const Eigen::Matrix<Real, 3, 1> &b)
{
  return {a.y() * b.z() - a.z() * b.y(), a.z() * b.x() - a.x() * b.z(), a.x() * b.y() - a.y() * b.x()};
}

/// Two particles, seen from the first one. Branches end at the contact point and make up the distance, which is what keeps a
/// bond of unequal particles free of force when the pair turns as a rigid body.
template <int dim, typename Real = double>
struct Pair
{
  Vector<dim, Real> normal; ///< unit vector from the first to the second particle
  Real distance;            ///< of the centres [m]
  Real share_first;         ///< branch of the first particle / distance [-]
  Real share_second;        ///< branch of the second particle / distance [-]
};

/// Branches are like @p radius_from to @p radius_to; for bonds these are weighted_radius().
template <int dim, typename Real = double>
[[gnu::always_inline]] inline Pair<dim, Real> make_pair(const Vector<dim, Real> &from, const Vector<dim, Real> &to,
                                                        const Real &radius_from, const Real &radius_to)
{
  using std::sqrt;
  const Vector<dim, Real> between = to - from;
  const Real distance = sqrt(between.squaredNorm());
  const Real per_length = Real(1.) / (radius_from + radius_to);
  return {between * (Real(1.) / distance), distance, radius_from * per_length, radius_to * per_length};
}

/// Deformation of an intact bond.
template <int dim, typename Real = double>
struct BondStrain
{
  Real elongation;         ///< u_n = d - d0 [m]
  Vector<dim, Real> shear; ///< u_t, displacement of the second particle against the first across the bond [m]
  Real slope;              ///< derivative of |u_t| by a displacement across the bond, 1 + O(strain) [-]
};

/// @param rest_length d0 [m]; @param first, @param second the reference normal of the bond turned with either particle.
/// u_t = d0 (n (n.e) - e), e = shares-weighted mean of the turned reference normals.
template <int dim, typename Real>
[[gnu::always_inline]] inline BondStrain<dim, Real> bond_strain(const Pair<dim, Real> &pair, const Real &rest_length,
                                                                const Vector<dim, Real> &first, const Vector<dim, Real> &second)
{
  const Vector<dim, Real> reference = pair.share_first * first + pair.share_second * second;
  const Real aligned = pair.normal.dot(reference);
  return {pair.distance - rest_length, rest_length * (aligned * pair.normal - reference),
          aligned * rest_length / pair.distance};
}

/// What a pair does to its first particle; the second one gets -force.
template <int dim, typename Real = double>
struct PairLoad
{
  Vector<dim, Real> force;      ///< on the first particle [N]
  Spin<dim, Real> torque_first; ///< [N m]
  Spin<dim, Real> torque_second;
};

/// Minus the derivative of the potential. force x distance balances the two torques exactly.
/// @param share of the load that counts, the weight of the bond [-].
template <int dim, typename Real>
[[gnu::always_inline]] inline PairLoad<dim, Real> bond_load(const Pair<dim, Real> &pair, const BondStrain<dim, Real> &strain,
                                                            const Real &rest_length, const Vector<dim, Real> &first,
                                                            const Vector<dim, Real> &second, const BondParameters &bond,
                                                            const Real &share = Real(1.))
{
  const Real k_n = share * Real(bond.k_n), k_t = share * Real(bond.k_t);
  const Real arm = k_t * rest_length;
  return {k_n * strain.elongation * pair.normal + k_t * strain.slope * strain.shear,
          pair.share_first * arm * cross(first, strain.shear), pair.share_second * arm * cross(second, strain.shear)};
}

/// Of a bond that resists that its ends turn apart, on the first particle; the second one gets the opposite [N m].
/// @param rolling see rolling_resistance()
template <int dim, typename Real>
[[gnu::always_inline]] inline Spin<dim, Real> rolling_torque(const Real &rolling, const Real &rest_length,
                                                             const Vector<dim, Real> &first, const Vector<dim, Real> &second,
                                                             const BondParameters &bond)
{
  return rolling * Real(bond.k_t) * rest_length * rest_length * cross(first, second);
}
template <int dim>
double rolling_energy(double rolling, double rest_length, const Vector<dim> &first, const Vector<dim> &second,
                      const BondParameters &bond)
{
  return 0.5 * rolling * bond.k_t * rest_length * rest_length * (first - second).squaredNorm();
}

template <int dim>
double bond_energy(const BondStrain<dim> &strain, const BondParameters &bond)
{
  return 0.5 * (bond.k_n * strain.elongation * strain.elongation + bond.k_t * strain.shear.squaredNorm());
}

enum class Failure
{
  none,
  tension,
  shear
};

/// F_n >= R_n.
template <int dim, typename Real>
[[gnu::always_inline]] inline auto fails_in_tension(const BondStrain<dim, Real> &strain, const BondParameters &bond)
{
  return Real(bond.k_n) * strain.elongation >= Real(bond.R_n);
}

/// |F_t| >= R_t + mu_b F_c: Mohr-Coulomb with the cohesion R_t; tension takes nothing away from it.
template <int dim, typename Real>
[[gnu::always_inline]] inline auto fails_in_shear(const BondStrain<dim, Real> &strain, const BondParameters &bond)
{
  using std::min;
  const Real strength = Real(bond.R_t) - Real(bond.shear_friction * bond.k_n) * min(Real(0.), strain.elongation);
  return Real(bond.k_t * bond.k_t) * strain.shear.squaredNorm() >= strength * strength;
}

/// Tension and shear are checked independently, compression alone never breaks the bond (Onate & Rojek 2004). Compression
/// raises the shear strength when the bond has internal friction (the law of CIMNE's KDEM).
template <int dim>
Failure bond_failure(const BondStrain<dim> &strain, const BondParameters &bond)
{
  if (fails_in_tension(strain, bond))
    return Failure::tension;
  return fails_in_shear(strain, bond) ? Failure::shear : Failure::none;
}

/// Distance at which an unbonded pair begins to touch [m]. Particles of a packing may overlap as stored: the length of a
/// former bond makes sure that this overlap does not push when the bond breaks. @param rest_length 0 when never bonded.
inline double contact_length(double radii, double rest_length)
{
  return rest_length > 0. ? std::min(radii, rest_length) : radii;
}

/// Velocity of the second particle against the first at their contact point [m/s].
template <int dim, typename Real = double>
[[gnu::always_inline]] inline Vector<dim, Real>
contact_velocity(const Pair<dim, Real> &pair, const Vector<dim, Real> &velocity_first, const Vector<dim, Real> &velocity_second,
                 const Spin<dim, Real> &spin_first, const Spin<dim, Real> &spin_second)
{
  const Spin<dim, Real> roll = pair.distance * (pair.share_first * spin_first + pair.share_second * spin_second);
  return velocity_second - velocity_first - cross(roll, pair.normal);
}

/// Torques of a force that acts at the contact point.
template <int dim, typename Real = double>
[[gnu::always_inline]] inline PairLoad<dim, Real> contact_point_load(const Pair<dim, Real> &pair,
                                                                     const Vector<dim, Real> &force)
{
  const Spin<dim, Real> moment = pair.distance * cross(pair.normal, force);
  return {force, pair.share_first * moment, pair.share_second * moment};
}

/// Turns the tangential spring of a sliding contact into the present contact plane without changing its length.
template <int dim>
Vector<dim> in_contact_plane(const Vector<dim> &spring, const Vector<dim> &normal)
{
  const Vector<dim> projected = spring - normal.dot(spring) * normal;
  const double length = projected.norm();
  return length > 0. ? Vector<dim>(projected * (spring.norm() / length)) : Vector<dim>::Zero();
}

/// Coulomb's bound on the tangential force of a contact: trial and return.
template <int dim>
struct Friction
{
  Vector<dim> spring; ///< elastic tangential displacement that is left [m]
  Vector<dim> force;  ///< on the first particle, damping included [N]
  bool sliding;
};

/// @param trial tangential spring before the bound [m]; @param stiffness, @param normal_force of the contact [N/m], [N];
/// @param damping_force viscous tangential force on the first particle [N], dropped while sliding.
template <int dim>
Friction<dim> coulomb(const Vector<dim> &trial, double stiffness, double normal_force, double coefficient,
                      const Vector<dim> &damping_force)
{
  const double limit = coefficient * normal_force;
  const Vector<dim> sticking = stiffness * trial + damping_force;
  if (sticking.squaredNorm() <= limit * limit)
    return {trial, sticking, false};
  const double elastic = stiffness * trial.norm();
  const Vector<dim> spring = elastic > limit ? Vector<dim>(trial * (limit / elastic)) : trial;
  return {spring, stiffness * spring, true};
}

/// Viscosity of a spring with a fraction of its critical damping, c = 2 xi sqrt(m12 k) (Onate & Rojek 2004) [N s/m].
inline double viscosity(double fraction, double mass_first, double mass_second, double stiffness)
{
  return 2. * fraction * std::sqrt(mass_first * mass_second / (mass_first + mass_second) * stiffness);
}
} // namespace kerf::dem::law
