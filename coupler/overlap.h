// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/case_file.h"
#include "coupler/region_distance.h"

#include <vector>

namespace kerf
{
/// Who models what: cells that were converted to particles, the overlap zone of width L_o around them, and the weights that
/// share mass and stiffness in it. Weights of both sides come from one distance function, so they always sum to one.
class Overlap
{
public:
  /// @param quadrature_points of the finite elements of this rank; @param particles all stored positions, kept by reference
  Overlap(const fem::Mesh &mesh, const Eigen::Matrix3Xd &quadrature_points, const Eigen::Matrix3Xd &particles,
          WeightFunction function, double width);

  /// Turns cells into particle region; cells that already are one are ignored.
  void convert(const std::vector<int> &cells);

  bool is_converted(int cell) const { return converted[cell]; }
  int n_converted() const { return n_converted_cells; }
  double width() const { return overlap_width; }

  /// FE weight alpha of the quadrature points of this rank.
  Eigen::VectorXd fe_weights() const;
  /// DE weight of every stored particle, zero outside particle region and overlap.
  Eigen::VectorXd de_weights() const;

  /// A stored particle that is in the particle region or in the overlap.
  bool needs_particle(int index) const { return particle_distance.values()[index] < overlap_width; }
  /// A particle that is tied to the finite elements (DC of the seed, eq. 4).
  bool is_constrained(int index) const { return needs_particle(index) && particle_distance.values()[index] > 0.; }
  /// Distance of a cell's centre from the particle region, at most the overlap width [m].
  double distance_of_cell(int cell) const { return cell_distance.values()[cell]; }

private:
  Eigen::Matrix3Xd centres;
  double overlap_width;
  WeightFunction function;
  std::vector<char> converted;
  int n_converted_cells = 0;
  RegionDistance particle_distance, quadrature_distance, cell_distance;
};
} // namespace kerf
