// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/packing/packing.h"

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mpi.h>

/// The particles: a LIGGGHTS instance with the rock bond. Plain C++ and Eigen types only; vectors always have three
/// components (z = 0 in two dimensions), SI units, two dimensions mean cylinders per metre of thickness.
namespace kerf::dem
{
/// Elastic-perfectly-brittle bond and the contact that is left after failure (Onate & Rojek 2004; Rojek et al. 2012), with the
/// pressure-dependent shear strength of CIMNE's later law KDEM as an option.
struct BondParameters
{
  double k_n = 0.;      ///< normal stiffness [N/m] (2D: per metre)
  double k_t = 0.;      ///< tangential stiffness, same unit
  double R_n = 0.;      ///< tensile strength [N] (2D: per metre)
  double R_t = 0.;      ///< shear strength, same unit
  double friction = 0.; ///< Coulomb coefficient after failure [-]
  double damping = 0.;  ///< fraction of critical damping of the contact, normal and tangential [-]
  /// mu_b, what compression F_c of the intact bond adds to its shear strength: R_t + mu_b F_c [-]; 0: Onate & Rojek 2004
  double shear_friction = 0.;
  /// Bonds of less weight do not break: most of what they stand for is an elastic continuum [-]
  double breaking_weight = 0.;
};

struct Settings
{
  MPI_Comm comm = MPI_COMM_WORLD;
  const Packing *packing = nullptr; ///< the store, kept alive by the caller, the same on every rank
  BondParameters bond;
  double density = 0.;       ///< of a particle, rock density / solid fraction [kg/m^3]
  double local_damping = 0.; ///< Cundall's non-viscous damping, F -= a |F| v/|v|, [0, 1)
  double time_step = 0.;     ///< [s]
  /// Particles outside are taken out and counted [m]; along the periodic axes of the packing its box is the domain.
  Eigen::Vector3d domain_lower, domain_upper;
};

/// The box of the particle engine [m]: along periodic axes that of the packing, in 2D around z = 0, else the domain as set.
struct EngineBox
{
  Eigen::Vector3d lower, upper;
  std::array<char, 3> boundary; ///< 'p' periodic, 'f' particles leave there; as the engine calls them
};
EngineBox engine_box(const Settings &settings);

/// A stored particle and the state it starts with.
struct NewParticle
{
  int index = -1;                                             ///< in the packing
  Eigen::Vector3d displacement = Eigen::Vector3d::Zero();     ///< from the stored position [m]
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();         ///< [m/s]
  Eigen::Vector3d rotation = Eigen::Vector3d::Zero();         ///< rotation vector [rad]
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero(); ///< [rad/s]
};

using Vectors = Eigen::Map<Eigen::Matrix3Xd>;

/// Particles of this rank, straight in the engine's memory; valid until the next call of DemSide.
struct Particles
{
  int n = 0;
  const int *index = nullptr;              ///< in the packing, n values
  Vectors position{nullptr, 3, 0};         ///< [m]; in a periodic packing of one image, see Packing::displacement()
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

/// Why the hook is called: in a step after the positions moved, or when forces are set up again without a step.
enum class Phase
{
  step,
  setup
};
/// Called every step on every rank after the bond and contact forces, before the second half kick; adds outer forces.
using ForceHook = std::function<void(Phase, Particles &)>;

/// A bond that failed.
struct BrokenBond
{
  std::int64_t step = 0;
  int first = -1, second = -1;                        ///< indices in the packing, first < second
  bool shear = false;                                 ///< failed by |F_t| >= R_t + mu_b F_c, else by F_n >= R_n
  Eigen::Vector3d position = Eigen::Vector3d::Zero(); ///< of the contact point [m]
};

/// A pair that is bonded at present (output).
struct ActiveBond
{
  int first = -1, second = -1;
  Eigen::Vector3d a, b;                            ///< ends [m]
  double normal_force = 0.;                        ///< tension positive, not weighted [N]
  double shear_force = 0.;                         ///< [N]
  Eigen::Vector3d force = Eigen::Vector3d::Zero(); ///< on the first end, of the bond's springs [N]
};

struct Energies
{
  double kinetic = 0.; ///< translation and rotation, weighted masses [J]
  /// What a finite step adds to it: m/2 v^{n-1/2} v^{n+1/2} = m/2 v^n v^n - dt^2/8 F^2/m, likewise for rotations [J]. Their sum
  /// grows by exactly the work of all forces by the trapezoidal rule, so balances of energy hold with it.
  double finite_step = 0.;
  double elastic = 0.;  ///< bonds and contacts, weighted [J]
  double damping = 0.;  ///< dissipated by contact and local damping since the start [J]
  double friction = 0.; ///< dissipated by sliding since the start [J]
  double released = 0.; ///< elastic energy lost at bond failure since the start [J]
};

/// All functions are collective unless stated; totals are the same on every rank.
class DemSide
{
public:
  explicit DemSide(const Settings &settings);
  ~DemSide();
  DemSide(const DemSide &) = delete;
  DemSide &operator=(const DemSide &) = delete;

  /// Takes particles out of the store. @p particles is the same list on every rank; none of them may be active. Bonds of the
  /// store between a new and any active particle are created with the state of the projected displacement.
  /// Follow with set_weights() and setup().
  void insert(const std::vector<NewParticle> &particles);

  /// Puts active particles back into the store, the same list on every rank; their bonds and contacts end without a trace, so
  /// none of them should have a broken bond. They can be inserted again. Follow with set_weights() and setup().
  void remove(const std::vector<int> &particles);

  /// DE weight in [0, 1] of every particle of the store (only those of active particles are read; zero at the outer end of an
  /// overlap, for a particle that is bonded to one with weight). A contact has the
  /// weight of its point, see bond_weight(); a particle's mass is its full mass times the mean weight of its stored bonds to
  /// active particles, which keeps its frequency below that of the unweighted pack. Follow with setup() or compute_forces().
  void set_weights(const Eigen::VectorXd &weight);

  /// Exchanges, builds lists, creates pending bonds and computes all forces at the present positions without a step.
  void setup(const ForceHook &hook);

  /// The same with the lists of the last setup(), for particles that have moved since by less than half of their skin.
  void compute_forces(const ForceHook &hook);

  /// Advances by @p steps steps. Without any active particle only the hook is called, with no particles.
  void advance(int steps, const ForceHook &hook);

  Particles particles();                      ///< not collective
  int n_active() const;                       ///< over all ranks
  const std::vector<char> &is_active() const; ///< by index in the packing, same on every rank. Not collective
  /// By index in the packing: out of the store, active or left the domain. Not collective
  const std::vector<char> &is_taken() const;
  /// Indices in the packing of the particles that left the domain since the start, in this order. Not collective
  const std::vector<int> &left_domain() const;

  std::int64_t n_bonds_intact() const;
  std::int64_t n_bonds_broken() const;          ///< since the start
  std::vector<BrokenBond> broken_bonds() const; ///< of this rank (each bond on exactly one rank), since the start
  /// Bonds of this rank (each bond on exactly one rank). @p target by index in the packing: only those with a target end;
  /// empty: all. Not collective
  std::vector<ActiveBond> bonds(const std::vector<char> &target = {}) const;
  Energies energies() const;

  /// What the particles of this rank look like to a person: per local particle, broken bonds / stored bonds in [0,1].
  std::vector<double> damage() const;

private:
  struct Engine;
  std::unique_ptr<Engine> engine;
};

/// Version string of the particle library.
std::string library_version();
} // namespace kerf::dem
