// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>

/// Data that the particle side exchanges with its callers: plain C++ and Eigen types. Vectors always have three components (z =
/// 0 in two dimensions). Units are SI; in two dimensions particles are cylinders and all quantities are per metre of thickness.
namespace kerf::dem
{
/// A stored particle and its initial state.
struct NewParticle
{
  int index = -1;                                             ///< in the packing
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();     ///< from the stored position [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();         ///< rotation vector [rad]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero(); ///< [rad/s]
};

using Vectors = Eigen::Map<Eigen::Matrix3Xd>;

/// Particles of this rank, in the memory of the particle engine. Valid until the next call of DemSide.
struct Particles
{
  int n = 0;
  const int *index = nullptr;              ///< in the packing, n values
  Vectors position{nullptr, 3, 0};         ///< [m]; in a periodic packing that of one image, see Packing::displacement()
  Vectors velocity{nullptr, 3, 0};         ///< in the hook: at the half step [m/s]
  Vectors angular_velocity{nullptr, 3, 0}; ///< [rad/s]
  Vectors force{nullptr, 3, 0};            ///< [N]
  Vectors torque{nullptr, 3, 0};           ///< [N m]
  const double *mass = nullptr;            ///< weighted [kg]
  const double *radius = nullptr;          ///< [m]
  const double *weight = nullptr;          ///< [-]
  double *rotation = nullptr;              ///< unit quaternion (w, x, y, z) of each particle, 4 n values
  std::uint64_t order = 0;                 ///< changes whenever particles changed rank, place or number
};

/// The reason for a call of the hook: a step, after the positions moved, or a force computation without a step.
enum class Phase
{
  step,
  setup
};
/// Adds external forces. Called on every rank after the bond and contact forces, in each step before the second half kick.
using ForceHook = std::function<void(Phase, Particles &)>;

/// A stored bond, by the indices of its ends in the packing, first < second.
using StoredPair = std::array<int, 2>;

/// A bond that failed, or was broken when its particles became active.
struct BrokenBond
{
  std::int64_t step = 0;
  int first = -1, second = -1;                        ///< indices in the packing, first < second
  bool shear = false;                                 ///< failed by |F_t| >= R_t + mu_b F_c, else by F_n >= R_n
  bool at_birth = false;                              ///< never was intact, see DemSide::insert()
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< of the contact point [m]
};

/// An intact bond, for output.
struct ActiveBond
{
  int first = -1, second = -1;                     ///< indices in the packing, first < second
  Eigen::Vector3d a, b;                            ///< ends [m]
  double normal_force = 0.;                        ///< tension positive, not weighted [N]
  double shear_force = 0.;                         ///< [N]
  Eigen::Vector3d force = Eigen::Vector3d::Zero(); ///< of the bond's springs on the first end [N]
};

struct Energies
{
  double kinetic = 0.; ///< of translation and rotation, with weighted masses [J]
  /// Correction of the kinetic energy for the finite step: m/2 v^{n-1/2} v^{n+1/2} = m/2 v^n v^n - dt^2/8 F^2/m, likewise for
  /// rotations [J]. The sum of both grows by exactly the work of all forces by the trapezoidal rule, so energy balances hold
  /// with it.
  double finite_step = 0.;
  double elastic = 0.;  ///< of bonds and contacts, weighted [J]
  double damping = 0.;  ///< dissipated by contact and local damping since the start [J]
  double friction = 0.; ///< dissipated by sliding since the start [J]
  double released = 0.; ///< elastic energy lost at bond failure since the start [J]
  double left = 0.;     ///< of particles that left the domain since the start, kinetic and of their bonds and contacts [J]
};
} // namespace kerf::dem
