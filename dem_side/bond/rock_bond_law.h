// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_parameters.h"
#include "dem_side/bond/simd.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

/// The rock bond, and the contact that remains after its failure, as pure functions of one pair.
///
/// The bond is elastic and perfectly brittle with one normal and one tangential spring (Onate & Rojek, CMAME 193, 2004,
/// sec. 2; Rojek et al., IJSS 49, 2012). The law is written in total form: every force is a derivative of the potential
///   U = k_n u_n^2 / 2 + k_t |u_t|^2 / 2
/// of the present positions and rotations. So there is no drift, and the pair conserves momentum, angular momentum and energy.
/// For small strains the law is the incremental one of the papers. Theory (3.4).
///
/// Real is double, or SimdPack for several pairs at once. Functions with branches exist for double only.
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
// Not deduced from arguments, so that an expression of Eigen can be passed as a vector.
template <int dim, typename Real = double>
using Vector = typename detail::Types<dim, Real>::Vector;
/// Rotation rates and moments: one component in two dimensions.
template <int dim, typename Real = double>
using Spin = typename detail::Types<dim, Real>::Spin;

/// Rotates a vector by 90 degrees. Built from its components, the result would be stored in two halves and read as one, which
/// stalls the processor.
inline Vector<2> quarter_turn(const Vector<2> &a)
{
  alignas(16) static constexpr double signs[2] = {-1., 1.};
  return a.reverse().cwiseProduct(Vector<2>::MapAligned(signs));
}
inline Vector<2, SimdPack> quarter_turn(const Vector<2, SimdPack> &a)
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

/// Two particles, seen from the first one. The branches end at the contact point and add up to the distance. This keeps a bond
/// between unequal particles free of force when the pair rotates as a rigid body.
template <int dim, typename Real = double>
struct Pair
{
  Vector<dim, Real> normal; ///< unit vector from the first to the second particle
  Real distance;            ///< of the centres [m]
  Real share_first;         ///< branch of the first particle / distance [-]
  Real share_second;        ///< branch of the second particle / distance [-]
};

/// The branches have the ratio of @p radius_from to @p radius_to, which for bonds are weighted_radius() [m].
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

/// @param rest_length d0 [m]; @p first, @p second the reference normal of the bond, rotated with either particle.
/// u_t = d0 (n (n.e) - e), where e is the mean of the rotated reference normals, weighted with the shares of the branches.
/// Theory (3.3).
template <int dim, typename Real>
[[gnu::always_inline]] inline BondStrain<dim, Real> bond_strain(const Pair<dim, Real> &pair, const Real &rest_length,
                                                                const Vector<dim, Real> &first, const Vector<dim, Real> &second)
{
  const Vector<dim, Real> reference = pair.share_first * first + pair.share_second * second;
  const Real aligned = pair.normal.dot(reference);
  return {pair.distance - rest_length, rest_length * (aligned * pair.normal - reference),
          aligned * rest_length / pair.distance};
}

/// Load of a pair on its particles; the force on the second one is -force.
template <int dim, typename Real = double>
struct PairLoad
{
  Vector<dim, Real> force;      ///< on the first particle [N]
  Spin<dim, Real> torque_first; ///< [N m]
  Spin<dim, Real> torque_second;
};

/// Minus the derivative of the potential. The moment of the two forces balances the two torques exactly.
/// Theory (3.5), (3.6).
/// @param share the weight of the bond, a factor on its load [-].
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

/// Torque on the first particle of a bond that resists the relative rotation of its ends [N m]. The second particle gets the
/// opposite torque. @param rolling see rolling_resistance()
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

/// F_n >= R_n. Theory (3.7).
template <int dim, typename Real>
[[gnu::always_inline]] inline auto fails_in_tension(const BondStrain<dim, Real> &strain, const BondParameters &bond)
{
  return Real(bond.k_n) * strain.elongation >= Real(bond.R_n);
}

/// |F_t| >= R_t + mu_b F_c: Mohr-Coulomb with the cohesion R_t, which tension does not reduce. Theory (3.8).
template <int dim, typename Real>
[[gnu::always_inline]] inline auto fails_in_shear(const BondStrain<dim, Real> &strain, const BondParameters &bond)
{
  using std::min;
  const Real strength = Real(bond.R_t) - Real(bond.shear_friction * bond.k_n) * min(Real(0.), strain.elongation);
  return Real(bond.k_t * bond.k_t) * strain.shear.squaredNorm() >= strength * strength;
}

/// Tension and shear are checked independently. Compression alone never breaks the bond (Onate & Rojek 2004). Compression
/// raises the shear strength of a bond with internal friction (the law of CIMNE's KDEM).
template <int dim>
Failure bond_failure(const BondStrain<dim> &strain, const BondParameters &bond)
{
  if (fails_in_tension(strain, bond))
    return Failure::tension;
  return fails_in_shear(strain, bond) ? Failure::shear : Failure::none;
}

/// Whether two deformations of a bond differ by more than the bond can bear. Theory (7.20).
template <int dim>
bool misfits(const BondStrain<dim> &actual, const BondStrain<dim> &expected, const BondParameters &bond)
{
  return bond.k_n * std::abs(actual.elongation - expected.elongation) >= bond.R_n ||
         bond.k_t * (actual.shear - expected.shear).norm() >= bond.R_t;
}

/// Distance below which an unbonded pair is in contact [m]. Stored particles may overlap. For a broken bond the contact begins
/// at its rest length, so that this overlap causes no force when the bond breaks. @param rest_length 0 when never bonded.
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

/// Rotates the tangential spring of a contact into the present contact plane without changing its length.
template <int dim>
Vector<dim> in_contact_plane(const Vector<dim> &spring, const Vector<dim> &normal)
{
  const Vector<dim> projected = spring - normal.dot(spring) * normal;
  const double length = projected.norm();
  return length > 0. ? Vector<dim>(projected * (spring.norm() / length)) : Vector<dim>::Zero();
}

/// Result of Coulomb's law for the tangential force of a contact.
template <int dim>
struct Friction
{
  Vector<dim> spring; ///< elastic tangential displacement after the return [m]
  Vector<dim> force;  ///< on the first particle, damping included [N]
  bool sliding;
};

/// Trial force and return to Coulomb's limit. Theory (3.13). @param trial tangential spring before the return [m];
/// @p stiffness and @p normal_force of the contact [N/m], [N];
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

/// Viscosity of a spring with a fraction of its critical damping, c = 2 xi sqrt(m12 k) (Onate & Rojek 2004) [N s/m]. Theory
/// (3.14).
inline double viscosity(double fraction, double mass_first, double mass_second, double stiffness)
{
  return 2. * fraction * std::sqrt(mass_first * mass_second / (mass_first + mass_second) * stiffness);
}
} // namespace kerf::dem::law
