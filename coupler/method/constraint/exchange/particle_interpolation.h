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
/// A tied particle and the nodes that carry it.
struct InterpolatedParticle
{
  int particle = -1; ///< of this rank
  int row = -1;      ///< among all tied particles
  int n = 0;
  double share = 1.;
  std::array<bool, 3> blocked; ///< directions in which it cannot move
  int cell = -1;
  std::array<double, 3> xi;     ///< place in the cell, see fem::Interpolation
  std::array<int, 8> node;      ///< columns of the window
  std::array<double, 8> N;      ///< shape functions at the stored position
  std::array<double, 3> origin; ///< stored position [m]
};

/// What became of the entries of the whole model.
enum class InterpolationChange
{
  none,
  renumbered, ///< the same entries in the same order, but particles have other places in the arrays
  renewed     ///< others, or on other ranks
};

/// Which nodes the window of a rank shows.
enum class WindowNodes
{
  own, ///< those of the entries of the rank
  all  ///< those of all entries
};

/// The tied particles of this rank with their rows of the interpolation N, and the window of the finite elements that belongs
/// to them. Rows live in the reference configuration: found once, valid wherever the particle moves.
class ParticleInterpolation
{
public:
  ParticleInterpolation(const dem::Packing &packing, WindowNodes window, MPI_Comm comm);

  void set_particles(const std::vector<TiedParticle> &particles);
  /// The window is to show the nodes @p around each node of an entry, too.
  void widen(std::function<std::vector<int>(int node)> around) { nodes_around = std::move(around); }
  int n_particles() const { return static_cast<int>(tied.size()); }

  /// Entries for the particles as they lie on this rank now; the same answer on all ranks. Sets the window of the finite
  /// elements when entries are renewed. Collective.
  InterpolationChange update(const dem::Particles &particles, fem::FemSide &fem);

  /// The mass that a spring between a particle and its point moves when its neighbours' springs pull alike,
  ///   1/mu_i = 1/m_i + sum_a N_ia/M_a sum_j share_j N_ja   [kg],
  /// for the entries as they are; 0 when a node without mass is involved, which can carry no reaction. No motion makes
  /// sum_i share_i mu_i |chi_i|^2 larger than the sum of the masses times its square. Collective. Theory (5.4), (5.6).
  std::vector<double> tied_masses(const dem::Particles &particles, fem::FemSide &fem) const;

  const std::vector<InterpolatedParticle> &entries() const { return list; }
  const std::vector<int> &window() const { return shown; } ///< nodes of the mesh, those of the entries first
  int n_window() const { return static_cast<int>(shown.size()); }
  int n_carriers() const { return n_carrier_nodes; }
  const std::vector<int> &columns() const { return column_of; } ///< of the window, by node of the mesh; -1: not shown

  /// value of the particle - sum_a N_a value of node a
  template <typename ParticleValues>
  static Eigen::Vector3d gap(const InterpolatedParticle &entry, const ParticleValues &particle, const Eigen::Matrix3Xd &node)
  {
    Eigen::Vector3d result = particle.col(entry.particle);
    for (int a = 0; a < entry.n; ++a)
      result -= entry.N[a] * node.col(entry.node[a]);
    return result;
  }
  /// chi: displacement of the particle less that of the finite elements at its place [m]. Across periodic axes particles come
  /// back on the other side and nodes do not.
  Eigen::Vector3d displacement_gap(const InterpolatedParticle &entry, const dem::Particles &particles,
                                   const Eigen::Matrix3Xd &u) const
  {
    return packing.shortest(gap(entry, particles.position, u) - Eigen::Map<const Eigen::Vector3d>(entry.origin.data()));
  }
  /// node a gets N_a value
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
  std::vector<int> row_of; // by index in the packing: place among the rows, -1 for particles that are not tied
  std::vector<InterpolatedParticle> list;
  std::function<std::vector<int>(int)> nodes_around;
  std::vector<int> shown, column_of;
  int n_carrier_nodes = 0;
  bool stale = true, located = true;
  std::uint64_t order = 0;
};

} // namespace kerf
