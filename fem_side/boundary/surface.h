// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/mesh/nodal_space.h"

#include <utility>

namespace kerf::fem
{
/// Number of points of a face with Gauss points in this many parts along each of its directions.
template <int dim>
constexpr int n_points_of_face(const int parts)
{
  return q1::n_nodes<dim - 1> * (dim == 2 ? parts : parts * parts);
}

/// Calls visit(face coordinates) for these points.
template <int dim, typename Visit>
void for_each_gauss_point(const int parts, const Visit &visit)
{
  constexpr int n = q1::n_nodes<dim - 1>;
  const double part = 1. / parts;
  for (int s = 0; s < n_points_of_face<dim>(parts) / n; ++s)
    for (int p = 0; p < n; ++p)
    {
      q1::Point<dim - 1> xi = part * q1::gauss_point<dim - 1>(p);
      for (int d = 0, rest = s; d < dim - 1; ++d, rest /= parts)
        xi[d] += -1. + part * (2 * (rest % parts) + 1);
      visit(xi);
    }
}

/// A boundary face of an owned cell. Its points are those of face_points().
template <int dim>
struct SurfaceFace
{
  static constexpr int n = q1::n_nodes<dim - 1>; ///< nodes

  int number = 0;          ///< among the faces of the mesh's boundary
  std::array<int, n> dofs; ///< local position of the first component of each node
  double turn = 1.;        ///< -1 if the face's coordinates give the inner normal
  int parts = 1;           ///< Gauss points of this many parts along each direction of the face
  int first_point = 0;     ///< among the points of the surface
  bool has_weight = true;  ///< at any of its points

  int n_points() const { return n_points_of_face<dim>(parts); }
};

/// The outer boundary of the owned cells: points at which loads, dashpots and contacts act, with the weights of the continuum.
template <int dim>
class Surface
{
public:
  static constexpr int n = SurfaceFace<dim>::n;

  /// @param spacing largest distance of the points [m]; 0: the Gauss points of the faces
  Surface(const NodalSpace<dim> &space, double spacing);

  /// Reference positions of all points [m].
  const Eigen::Matrix3Xd &all_points() const { return points; }
  /// @p weights at all_points(). Throws std::logic_error on another number.
  void set_weights(const Eigen::VectorXd &weights);

  const std::vector<SurfaceFace<dim>> &all_faces() const { return faces; }
  /// Calls visit(N, area, normal) for the points of a face: shape functions of its nodes, alpha-weighted reference area [m^2]
  /// (2D: [m] per metre), outer normal.
  template <typename Visit>
  void for_each_load_point(const SurfaceFace<dim> &face, const Visit &visit) const
  {
    for_each_point(face,
                   [&](const q1::Point<dim - 1> &xi, const int point)
                   {
                     const q1::Point<dim> area = areas.col(point).template head<dim>();
                     visit(q1::shape_values<dim - 1>(xi), alpha[point] * area.norm(), q1::Point<dim>(area.normalized()));
                   });
  }

  /// Points of all weighted faces whose bounding box meets the box [lower, upper] [m] and whose enclosing ball is near. Copies
  /// and slaves in displacements @p u [m] and velocities @p v [m/s] must be up to date. Remembers the points for add_forces().
  void find_points(const double *u, const double *v, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper,
                   const NearTest &near, SurfacePoints &found_points) const;
  /// Distributes forces [N] at the points of the last find_points() to nodes, also to copies. The work of a force on its point
  /// equals the work of the nodal forces. Throws std::logic_error unless there is one force for each point.
  void add_forces(const Eigen::Matrix3Xd &forces, double *f) const;

  /// Owned components that surface forces can reach, also from faces of other ranks.
  const std::vector<int> &owned_dofs() const { return surface_dofs; }

private:
  /// Calls visit(face coordinates, number of the point) for the points of a face.
  template <typename Visit>
  static void for_each_point(const SurfaceFace<dim> &face, const Visit &visit)
  {
    int point = face.first_point;
    for_each_gauss_point<dim>(face.parts, [&](const q1::Point<dim - 1> &xi) { visit(xi, point++); });
  }

  std::vector<SurfaceFace<dim>> faces;
  std::vector<int> surface_dofs;
  std::vector<q1::NodalValues<dim - 1, dim>> positions; ///< reference positions of the nodes of each face [m]
  Eigen::Matrix3Xd points, areas;                       ///< see FacePoints, of all faces
  Eigen::VectorXd alpha;                                ///< at the points
  mutable std::vector<int> found;                       ///< faces of the last find_points()
};
} // namespace kerf::fem
