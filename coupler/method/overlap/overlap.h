// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/tied_particle.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "coupler/method/overlap/region_distance.h"
#include "dem_side/packing/stored_bonds.h"

#include <vector>

namespace kerf
{
/// The domain decomposition: the particle region (converted cells), the overlap of width L_o around it, and the weights that
/// partition mass and stiffness between both models. The weights of both sides derive from one distance function, so they sum
/// to one everywhere.
class Overlap
{
public:
  /// @p mesh, @p packing and points are kept by reference. @param quadrature_points and @param surface_points of the finite
  /// elements of this rank [m]. @param width L_o [m]
  Overlap(const fem::Mesh &mesh, const Eigen::Matrix3Xd &quadrature_points, const Eigen::Matrix3Xd &surface_points,
          const dem::Packing &packing, WeightFunction function, double width);

  /// Adds points whose weights are wanted [m], kept by reference. Call it before the first conversion. @return their number for
  /// fe_weights_at()
  int add_points(const Eigen::Matrix3Xd &points);

  /// Adds cells to the particle region. Cells that belong to it already are ignored.
  void convert(const std::vector<int> &cells);

  /// Removes cells from the particle region. Cells outside of it are ignored.
  void restore(const std::vector<int> &cells);

  bool is_converted(int cell) const { return converted[cell]; }
  int n_converted() const { return n_converted_cells; }
  int n_changes() const { return changes; } ///< grows whenever weights may have changed
  double width() const { return overlap_width; }

  /// FE weight alpha at the quadrature points of this rank [-].
  Eigen::VectorXd fe_weights() const { return fe_weights_at(0); }
  /// FE weight alpha at the points of the surface of this rank [-].
  Eigen::VectorXd fe_surface_weights() const { return fe_weights_at(1); }
  /// FE weight alpha at points that add_points() gave a number [-].
  Eigen::VectorXd fe_weights_at(int number) const;
  /// DE weight of every stored particle [-], zero outside the particle region and the overlap.
  const Eigen::VectorXd &de_weights() const { return particle_weight; }

  /// Whether the model needs a stored particle: it has weight, or a bond to a particle with weight.
  bool needs_particle(int index) const { return needed[index]; }
  /// Particles tied to the finite elements (DC of Labra et al., eq. (4)), ascending. They lie in the overlap, on the border of
  /// the particle region, or just beyond the overlap with a bond to a particle with weight.
  const std::vector<TiedParticle> &tied_particles() const { return tied; }
  /// Distance of a cell's centre from the particle region [m], limited to the overlap width plus two particle diameters.
  double distance_of_cell(int cell) const { return cell_distance.values()[cell]; }

  const dem::StoredBonds &bonds() const { return stored_bonds; }

private:
  void find_particles();
  std::vector<char> on_region_border() const;
  double share_of(int particle) const;
  void find_inside_parts();

  const fem::Mesh &mesh;
  const dem::Packing &packing;
  Eigen::Matrix3Xd centres;
  dem::StoredBonds stored_bonds;
  double overlap_width;
  WeightFunction function;
  std::vector<std::vector<int>> cells_of_node;
  std::vector<char> converted;
  int n_converted_cells = 0;
  int changes = 0;
  RegionDistance particle_distance, cell_distance;
  std::vector<RegionDistance> point_distances; // quadrature points, points of the surface, then added ones
  Eigen::VectorXd inside_part;                 // of each particle's diameter, across the nearest face of the boundary
  Eigen::VectorXd particle_weight;
  std::vector<char> needed;
  std::vector<TiedParticle> tied;
};
} // namespace kerf
