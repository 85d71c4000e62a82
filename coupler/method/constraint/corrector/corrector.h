// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/fluctuations.h"
#include "coupler/method/constraint/corrector/recovered_gradient.h"
#include "coupler/method/constraint/corrector/strain_components.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"

#include <array>
#include <memory>
#include <unordered_map>
#include <vector>

namespace kerf
{
/// Corrected positions of particles, which fluctuate about the smooth field (see Fluctuations):
///   X_i + u + F C_i : E,   u = N u_a,   E = N E_a,   E_a = (F_a^T F_a - 1)/2,   F_a = 1 + H_a
/// with the gradients H_a recovered at the nodes and F in the middle of the particle's cell. The fluctuation rotates with the
/// rock. An energy of the gap to the corrected position is therefore invariant under rotations and conserves angular momentum.
/// Theory (6.4), (6.5).
class Corrector
{
public:
  /// Displacement of a particle as a linear function of nodal displacements, sum_b P_b u_b, linearised about the undeformed
  /// body.
  struct Row
  {
    std::vector<int> node; ///< mesh nodes
    std::vector<Eigen::Matrix3d> P;
  };

  /// @param packing kept by reference
  Corrector(const dem::Packing &packing, std::shared_ptr<const Fluctuations> fluctuations, const fem::FemSide &fem);

  /// Must be called before rows(), place() or gradient(). @param node_mass by node [kg]
  void set_masses(const Eigen::VectorXd &node_mass) { recovered.set_masses(node_mass); }

  /// Rows N + C : B of particles. B interpolates the strains that are recovered at the nodes. Theory (6.9).
  std::vector<Row> rows(const std::vector<int> &particles) const;

  /// Norms |P_b| of a row: the largest displacement of the particle for a unit displacement of each node.
  struct Lengths
  {
    std::vector<int> node;
    std::vector<double> length;
    int known_at = -1; ///< RecoveredGradient::last_change()
  };
  /// Norms of the rows of @p particles. The references are valid until the next call. Norms of particles of the last call are
  /// reused.
  std::vector<const Lengths *> lengths(const std::vector<int> &particles);

  /// Moves particles from the smooth field to their corrected positions and corrects their velocities. Theory (6.11). @param u
  /// displacement of all nodes [m]. @param v velocity of all nodes [m/s]
  void place(std::vector<dem::NewParticle> &particles, const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v) const;

  /// See Fluctuations::of().
  double of(int i, int component, int strain) const { return fluctuations->of(i, component, strain); }
  const RecoveredGradient &gradient() const { return recovered; }

private:
  int per_particle() const { return packing.dim == 2 ? 3 : 6; }
  template <int dim>
  std::vector<Row> rows_in(const std::vector<int> &particles) const;
  template <int dim>
  void place_in(std::vector<dem::NewParticle> &particles, const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v) const;

  const dem::Packing &packing;
  std::shared_ptr<const Fluctuations> fluctuations;
  RecoveredGradient recovered;
  std::unordered_map<int, Lengths> known_lengths; // by particle
};

/// For each row, sum_b |P_b|/M_b sum_j share_j |P_jb| [1/kg]. The sum of this and 1/m_i is 1/mu_i of the spring, see
/// ParticleInterpolation::tied_masses(). Negative when a node has no mass.
std::vector<double> inverse_masses_of_nodes(const std::vector<const Corrector::Lengths *> &rows,
                                            const std::vector<TiedParticle> &tied, const Eigen::VectorXd &node_mass);
} // namespace kerf
