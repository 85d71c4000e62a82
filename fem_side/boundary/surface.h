// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

namespace kerf::fem
{
/// A boundary face of an owned cell with its Gauss points.
template <int dim>
struct SurfaceFace
{
  static constexpr int n = q1::n_nodes<dim - 1>; ///< nodes and Gauss points

  int number = 0;                       ///< among the faces of the mesh's boundary
  int owned_cell = 0;                   ///< number of the cell among the owned ones
  int cell = 0;                         ///< number of the cell in the mesh
  std::array<int, n> dofs;              ///< local position of the first component of each node
  std::array<double, n> area;           ///< reference area of each point [m^2] (2D: [m] per metre)
  std::array<q1::Point<dim>, n> normal; ///< outer
  double alpha = 1.;                    ///< mean weight of the cell
  double turn = 1.;                     ///< -1 if the face's coordinates give the inner normal
  int parts = 1;                        ///< contact points: Gauss points of this many parts along each direction of the face
};

/// Contact points on the outer boundary of the owned cells.
template <int dim>
class Surface
{
public:
  static constexpr int n = SurfaceFace<dim>::n;

  /// @param spacing largest distance of the points that find_points() gives [m]; 0: the Gauss points of the faces
  Surface(const NodalSpace<dim> &space, double spacing);

  void set_weights(const Eigen::VectorXd &alpha);
  /// Points of all weighted faces whose bounding box meets the box [lower, upper] [m] and whose enclosing ball is near. Copies
  /// and slaves in displacements @p u [m] and velocities @p v [m/s] must be up to date. Remembers the points for add_forces().
  void find_points(const double *u, const double *v, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper,
                   const NearTest &near, SurfacePoints &points) const;
  /// Distributes forces [N] at the points of the last find_points() to nodes, also to copies. The work of a force on its point
  /// equals the work of the nodal forces. Throws std::logic_error unless there is one force for each point.
  void add_forces(const Eigen::Matrix3Xd &forces, double *f) const;

  const std::vector<SurfaceFace<dim>> &all_faces() const { return faces; }
  /// Owned components that surface forces can reach, also from faces of other ranks.
  const std::vector<int> &owned_dofs() const { return surface_dofs; }

private:
  /// Calls visit(face coordinates, weight) for the contact points of a face.
  template <typename Visit>
  static void for_each_point(const SurfaceFace<dim> &face, const Visit &visit);

  std::vector<SurfaceFace<dim>> faces;
  std::vector<int> surface_dofs;
  std::vector<q1::NodalValues<dim - 1, dim>> positions; ///< reference positions of the nodes of each face [m]
  mutable std::vector<int> found;                       ///< faces of the last find_points()
};
} // namespace kerf::fem
