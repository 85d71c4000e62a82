// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/tied_particle.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "coupler/method/overlap/region_distance.h"
#include "dem_side/packing/stored_bonds.h"

#include <vector>

namespace kerf
{
/// Who models what: cells that were converted to particles, the overlap zone of width L_o around them, and the weights that
/// share mass and stiffness in it. Weights of both sides come from one distance function, so they always sum to one.
class Overlap
{
public:
  /// @param quadrature_points of the finite elements of this rank; @param packing the store, kept by reference
  Overlap(const fem::Mesh &mesh, const Eigen::Matrix3Xd &quadrature_points, const dem::Packing &packing,
          WeightFunction function, double width);

  /// Turns cells into particle region; cells that already are one are ignored.
  void convert(const std::vector<int> &cells);

  /// Gives cells back to the finite elements; cells that are none of the particle region are ignored.
  void restore(const std::vector<int> &cells);

  bool is_converted(int cell) const { return converted[cell]; }
  int n_converted() const { return n_converted_cells; }
  double width() const { return overlap_width; }

  /// FE weight alpha of the quadrature points of this rank.
  Eigen::VectorXd fe_weights() const;
  /// DE weight of every stored particle, zero outside particle region and overlap.
  const Eigen::VectorXd &de_weights() const { return particle_weight; }

  /// A stored particle that takes part: it has weight, or a bond to one that has.
  bool needs_particle(int index) const { return needed[index]; }
  /// Particles tied to the finite elements (DC of Labra et al., eq. (4)), ascending: in the overlap, on the border of the
  /// particle region, and those that take part for the sake of a bond.
  const std::vector<TiedParticle> &tied_particles() const { return tied; }
  /// Distance of a cell's centre from the particle region, at most the overlap width and two particle diameters [m].
  double distance_of_cell(int cell) const { return cell_distance.values()[cell]; }

  const dem::StoredBonds &bonds() const { return stored_bonds; }

private:
  void find_particles();
  std::vector<char> on_region_border() const;
  double share_of(int particle) const;

  const fem::Mesh &mesh;
  const dem::Packing &packing;
  Eigen::Matrix3Xd centres;
  dem::StoredBonds stored_bonds;
  double overlap_width;
  WeightFunction function;
  std::vector<std::vector<int>> cells_of_node;
  std::vector<char> converted;
  int n_converted_cells = 0;
  RegionDistance particle_distance, quadrature_distance, cell_distance;
  Eigen::VectorXd particle_weight;
  std::vector<char> needed;
  std::vector<TiedParticle> tied;
};
} // namespace kerf
