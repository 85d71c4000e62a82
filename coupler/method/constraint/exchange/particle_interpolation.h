// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <array>
#include <cstdint>
#include <functional>
#include <vector>

namespace kerf
{
/// A tied particle of this rank and its interpolation from nodes.
struct InterpolatedParticle
{
  int particle = -1; ///< number on this rank
  int row = -1;      ///< position in the list of all tied particles
  int n = 0;
  double share = 1.;
  std::array<bool, 3> blocked; ///< directions in which its boundary conditions hold it
  int cell = -1;
  std::array<double, 3> xi;     ///< position in the cell, see fem::Interpolation
  std::array<int, 8> node;      ///< columns of the nodal window
  std::array<double, 8> N;      ///< shape functions at the stored position
  std::array<double, 3> origin; ///< stored position [m]
};

/// Change of the tied particles of the ranks since the last update.
enum class InterpolationChange
{
  none,
  renumbered, ///< the same particles in the same order, at other positions of their arrays
  renewed     ///< other particles, or on other ranks
};

/// Nodes in the nodal window of a rank.
enum class WindowNodes
{
  own, ///< nodes of the rank's tied particles
  all  ///< nodes of all tied particles
};

/// The tied particles of this rank with their rows of the interpolation N, and the nodal window of the finite elements that
/// they need. Rows refer to the reference configuration, so they are found once and stay valid when the particle moves.
class ParticleInterpolation
{
public:
  ParticleInterpolation(const dem::Packing &packing, WindowNodes window, MPI_Comm comm);

  void set_particles(const std::vector<TiedParticle> &particles);
  /// Adds the nodes @p around each node of a tied particle to the nodal window.
  void widen(std::function<std::vector<int>(int node)> around) { nodes_around = std::move(around); }
  int n_particles() const { return static_cast<int>(tied.size()); }

  /// Updates the entries for the particles that are on this rank now. The result is the same on all ranks. Sets the nodal
  /// window of the finite elements when the entries are renewed. Throws std::logic_error when a tied particle lies outside the
  /// mesh. Collective.
  InterpolationChange update(const dem::Particles &particles, fem::FemSide &fem);

  /// Reduced mass of a spring between a particle and the finite-element field, for equal forces in neighbouring springs,
  ///   1/mu_i = 1/m_i + sum_a N_ia/M_a sum_j share_j N_ja   [kg],
  /// for each entry. It is 0 when one of the nodes has no mass, since such a node cannot carry a reaction. In every motion
  /// sum_i share_i mu_i |chi_i|^2 is at most the sum of the masses times the squared displacements. Collective. Theory (5.4),
  /// (5.6).
  std::vector<double> tied_masses(const dem::Particles &particles, fem::FemSide &fem) const;

  const std::vector<InterpolatedParticle> &entries() const { return list; }
  const std::vector<int> &window() const { return shown; } ///< mesh nodes, those of the entries first
  int n_window() const { return static_cast<int>(shown.size()); }
  int n_carriers() const { return n_carrier_nodes; }
  const std::vector<int> &columns() const { return column_of; } ///< columns of the nodal window by mesh node; -1: not in it

  /// Value of the particle less sum_a N_a times the value of node a.
  template <typename ParticleValues>
  static Eigen::Vector3d mismatch(const InterpolatedParticle &entry, const ParticleValues &particle,
                                  const Eigen::Matrix3Xd &node)
  {
    Eigen::Vector3d result = particle.col(entry.particle);
    for (int a = 0; a < entry.n; ++a)
      result -= entry.N[a] * node.col(entry.node[a]);
    return result;
  }
  /// chi: displacement of the particle less that of the finite elements at its position [m]. Particles are wrapped across
  /// periodic axes, nodes are not; the shortest difference is returned.
  Eigen::Vector3d chi(const InterpolatedParticle &entry, const dem::Particles &particles, const Eigen::Matrix3Xd &u) const
  {
    return packing.shortest(mismatch(entry, particles.position, u) - Eigen::Map<const Eigen::Vector3d>(entry.origin.data()));
  }
  /// Adds N_a times @p value to each node a.
  static void spread(const InterpolatedParticle &entry, const Eigen::Vector3d &value, Eigen::Matrix3Xd &node)
  {
    for (int a = 0; a < entry.n; ++a)
      node.col(entry.node[a]) += entry.N[a] * value;
  }

private:
  struct Row
  {
    double share = 1.;
    int n = 0, cell = -1;
    std::array<double, 3> xi;
    std::array<int, 8> node;
    std::array<double, 8> N;
  };
  void locate(fem::FemSide &fem);
  bool renumber(const dem::Particles &particles);
  void renew(const dem::Particles &particles, fem::FemSide &fem);

  const dem::Packing &packing;
  WindowNodes which;
  MPI_Comm comm;
  std::vector<TiedParticle> tied;
  std::vector<Row> rows;
  std::vector<int> row_of; // by index in the packing: position in rows, -1 for particles that are not tied
  std::vector<InterpolatedParticle> list;
  std::function<std::vector<int>(int)> nodes_around;
  std::vector<int> shown, column_of;
  int n_carrier_nodes = 0;
  bool stale = true, located = true;
  std::uint64_t order = 0;
};

} // namespace kerf
