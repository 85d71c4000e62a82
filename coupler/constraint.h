// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <memory>
#include <unordered_map>

namespace kerf
{
/// Ties the particles of the overlap to the displacement field of the finite elements:
/// chi_i = u_i - sum_a N_a(X_i) u_a = 0 (seed, eq. 3). A method decides which forces enforce it.
class Constraint
{
public:
  virtual ~Constraint() = default;

  /// After every activation: @p indices are the constrained particles of the whole model (same list on every rank).
  virtual void set_particles(const std::vector<int> &indices) = 0;

  /// Adds equal and opposite forces to particles and nodes for the present positions; returns the energy stored in the
  /// constraint on this rank [J]. Collective.
  virtual double apply(dem::Particles &particles, fem::FemSide &fem) = 0;

  /// Number of constrained particles of the whole model.
  virtual int n_particles() const = 0;
};

/// Penalty forces f_i = -k_i chi_i on the particle and N_a k_i chi_i on the nodes (seed, eq. 4; the sum is zero because the
/// shape functions sum to one, and they exert no moment because they act along chi).
///  - constant: k_i = k_DF for all (the seed);
///  - mass scaled: k_i = beta mu_i/dt^2, 1/mu_i = 1/m_i + sum_a N_a^2/M_a with the weighted masses, so that the stiffness
///    falls with the masses towards the ends of the overlap and never governs the stable step.
class PenaltyConstraint : public Constraint
{
public:
  struct Settings
  {
    MPI_Comm comm = MPI_COMM_WORLD;
    bool mass_scaled = true;
    double stiffness = 0.; ///< k_DF [N/m] (2D: per metre), constant penalty only
    double beta = 0.;      ///< mass-scaled penalty only
    double time_step = 0.; ///< [s], mass-scaled penalty only
  };

  /// @param positions stored positions of all particles, kept by reference; @param periodic as Packing::periodic [m]
  PenaltyConstraint(const Settings &settings, const Eigen::Matrix3Xd &positions,
                    const Eigen::Vector3d &periodic = Eigen::Vector3d::Zero());

  void set_particles(const std::vector<int> &indices) override;
  double apply(dem::Particles &particles, fem::FemSide &fem) override;
  int n_particles() const override { return n_constrained; }

private:
  /// A constrained particle of this rank and where its nodes are in the window.
  struct Link
  {
    int particle = -1;
    Eigen::Vector3d reference;
    double stiffness = 0.;
    int n = 0;
    std::array<int, 8> window_node;
    std::array<double, 8> N;
  };
  void plan(const dem::Particles &particles, fem::FemSide &fem);

  Settings settings;
  const Eigen::Matrix3Xd &positions;
  Eigen::Vector3d periodic;
  int n_constrained = 0;
  std::vector<int> pending;                                  // not located yet
  std::unordered_map<int, fem::Interpolation> interpolation; // by packing index
  std::vector<Link> links;
  bool planned = false;
  std::uint64_t planned_order = 0;
  Eigen::Matrix3Xd window_displacement, window_force;
};
} // namespace kerf
