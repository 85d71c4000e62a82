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
/// Where particles belong that fluctuate about the smooth field (see Fluctuations):
///   X_i + u + F C_i : E,   u = N u_a,   E = N E_a,   E_a = (F_a^T F_a - 1)/2,   F_a = 1 + H_a
/// with the gradients H_a recovered at the nodes and F that in the middle of its cell. So the fluctuation turns with the rock,
/// and an energy of the gap to that place is none of a rotation: it keeps angular momentum. Theory (6.4), (6.5).
class Corrector
{
public:
  /// A particle's displacement by the displacements of nodes, about the body at rest: sum_b P_b u_b.
  struct Row
  {
    std::vector<int> node; ///< of the mesh
    std::vector<Eigen::Matrix3d> P;
  };

  /// @param packing kept by reference
  Corrector(const dem::Packing &packing, std::shared_ptr<const Fluctuations> fluctuations, const fem::FemSide &fem);

  /// Before rows, places or gradients are asked for. @param node_mass by node [kg]
  void set_masses(const Eigen::VectorXd &node_mass) { recovered.set_masses(node_mass); }

  /// Rows N + C : B of particles, B the strains interpolated from those recovered at the nodes. Theory (6.9).
  std::vector<Row> rows(const std::vector<int> &particles) const;

  /// What the nodes of a row are moved by at most: |P_b|.
  struct Lengths
  {
    std::vector<int> node;
    std::vector<double> length;
    int known_at = -1; ///< RecoveredGradient::last_change()
  };
  /// Of rows; those of the particles asked for before are kept, until the next call.
  std::vector<const Lengths *> lengths(const std::vector<int> &particles);

  /// Moves particles from the smooth field to where they belong, with the rates that go with it. Theory (6.11).
  /// @param u displacement and @param v velocity of all nodes
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

/// For each row, sum_b |P_b|/M_b sum_j share_j |P_jb| [1/kg]: with 1/m_i the inverse of the mass that the spring moves, see
/// ParticleInterpolation::tied_masses(). Negative when a node has no mass.
std::vector<double> inverse_masses_of_nodes(const std::vector<const Corrector::Lengths *> &rows,
                                            const std::vector<TiedParticle> &tied, const Eigen::VectorXd &node_mass);
} // namespace kerf
