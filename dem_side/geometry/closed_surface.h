// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/grid.h"

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace kerf::dem
{
/// A boundary as read from a file: segments in 2D, triangles in 3D. Neighbouring facets may have separate points at their
/// common corner.
struct SurfaceMesh
{
  Eigen::Matrix3Xd points;                ///< [m]
  std::vector<std::array<int, 3>> facets; ///< point numbers; 2D: the third is -1
};

/// Reads an STL file, ASCII or binary. Throws std::invalid_argument with one line that begins with "FILE: ".
SurfaceMesh read_stl(const std::string &path);

/// A closed boundary of any shape, several bodies and cavities included. It decides whether a point is inside and computes the
/// distance of points close to it.
class ClosedSurface
{
public:
  /// Merges equal points and orients all facets outwards. Throws std::invalid_argument with one line when the surface is empty
  /// or not closed, i.e. when an edge (2D: point) does not have exactly two facets.
  /// @param reach largest distance that can be computed [m], > 0
  ClosedSurface(int dim, const SurfaceMesh &mesh, double reach);

  /// The closest point of one facet.
  struct Foot
  {
    double distance;        ///< to the facet [m], negative outside
    Eigen::Vector3d inward; ///< unit vector of growing distance
  };
  /// Feet on all facets that are closer than @p within [m] (at most the reach), nearest first. A foot on a common edge or
  /// corner of several facets is listed once.
  const std::vector<Foot> &feet(const Eigen::Vector3d &x, double within) const;

  /// Whether the point is inside: a ray from it crosses an odd number of facets.
  bool contains(const Eigen::Vector3d &x) const;

  const Eigen::Vector3d &lower() const { return m_lower; } ///< bounding box [m]
  const Eigen::Vector3d &upper() const { return m_upper; }
  double volume() const { return m_volume; } ///< enclosed volume [m^3] (2D: area [m^2])
  double area() const { return m_area; }     ///< of the surface [m^2] (2D: length [m])
  /// Throws std::invalid_argument with one line when facets cut each other, or when there is more than one body.
  void check_one_body() const;
  /// Area of the cross-section normal to y at this height [m^2] (2D: its length [m]).
  double section(double y) const;
  /// Means of the powers 1 to 7 of the position along five fixed directions over the enclosed volume, relative to the bounding
  /// box, each in [-1, 1]. Two surfaces around the same body have the same numbers but for round-off, whatever their facets.
  /// Theory (11.18).
  std::vector<double> moments() const;
  double reach() const { return m_reach; }
  int n_facets() const { return static_cast<int>(m_facets.size()); }

private:
  using Facet = std::array<int, 3>;
  void merge_points(const SurfaceMesh &mesh);
  void find_neighbours();
  void orient_outwards();
  void compute_normals();
  void sort_into_cells();
  bool cuts(int facet, int other) const;
  void check_cuts() const;
  Eigen::Vector3d closest_point(const Facet &facet, const Eigen::Vector3d &x, int &feature) const;
  Eigen::Vector3d area_vector(int facet) const;

  int m_dim;
  double m_reach, m_volume = 0., m_area = 0.;
  Eigen::Vector3d m_lower, m_upper;
  std::vector<Eigen::Vector3d> m_points;
  std::vector<Facet> m_facets;
  std::vector<Eigen::Vector3d> m_bodies;        ///< a point of each outer part of the surface
  std::vector<std::array<int, 3>> m_neighbours; ///< facet across the edge from corner k to k + 1 (2D: beyond corner k)
  std::vector<Eigen::Vector3d> m_normals;       ///< of the facets, outwards
  std::vector<std::array<Eigen::Vector3d, 7>> m_pseudo_normals; ///< of each facet, its edges and its corners
  std::vector<Eigen::Vector4d> m_balls;                         ///< centre and radius of a ball around each facet
  Grid m_grid;
  std::vector<int> m_first_near, m_near;   ///< facets within reach of each cell of the grid
  std::vector<std::vector<int>> m_columns; ///< facets that intersect each column of cells along x
  mutable std::vector<Foot> m_feet;
};
} // namespace kerf::dem
