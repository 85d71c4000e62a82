// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <string>
#include <vector>

namespace kerf::dem
{
/// A boundary as it is read: segments in 2D, triangles in 3D; corners of neighbours may be separate points.
struct SurfaceMesh
{
  Eigen::Matrix3Xd points;                ///< [m]
  std::vector<std::array<int, 3>> facets; ///< point numbers; 2D: the third is -1
};

/// Reads an STL file, ASCII or binary. Throws std::runtime_error "FILE: what is wrong".
SurfaceMesh read_stl(const std::string &path);

/// A closed boundary of any shape (several bodies and cavities are allowed) that knows its inside and, close to it, the
/// distance.
class ClosedSurface
{
public:
  /// Merges equal points and turns all facets outwards. Throws std::runtime_error with one line when the surface is empty or
  /// not closed, i.e. an edge (2D: point) does not have exactly two facets.
  /// @param reach distances up to this are known [m], > 0
  ClosedSurface(int dim, const SurfaceMesh &mesh, double reach);

  /// The foot of a point on one facet.
  struct Foot
  {
    double distance;        ///< to the facet [m], negative outside
    Eigen::Vector3d inward; ///< unit vector along which the distance grows
  };
  /// Feet on all facets that are closer than @p within [m] (at most the reach), nearest first. A foot on an edge or corner that
  /// several facets share comes once.
  const std::vector<Foot> &feet(const Eigen::Vector3d &x, double within) const;

  /// Whether the point is inside, by the number of facets on a ray from it.
  bool contains(const Eigen::Vector3d &x) const;

  const Eigen::Vector3d &lower() const { return m_lower; } ///< bounding box [m]
  const Eigen::Vector3d &upper() const { return m_upper; }
  double volume() const { return m_volume; } ///< enclosed volume [m^3] (2D: area [m^2])
  double area() const { return m_area; }     ///< of the surface [m^2] (2D: length [m])
  double reach() const { return m_reach; }
  int n_facets() const { return static_cast<int>(m_facets.size()); }

private:
  using Facet = std::array<int, 3>;
  void merge_points(const SurfaceMesh &mesh);
  void find_neighbours();
  void turn_outwards();
  void compute_normals();
  void sort_into_cells();
  Eigen::Vector3d closest_point(const Facet &facet, const Eigen::Vector3d &x, int &feature) const;
  std::array<int, 3> cell_at(const Eigen::Vector3d &x) const;
  int index(const std::array<int, 3> &cell) const { return (cell[2] * m_cells[1] + cell[1]) * m_cells[0] + cell[0]; }

  int m_dim;
  double m_reach, m_volume = 0., m_area = 0.;
  Eigen::Vector3d m_lower, m_upper;
  std::vector<Eigen::Vector3d> m_points;
  std::vector<Facet> m_facets;
  std::vector<std::array<int, 3>> m_neighbours; ///< facet across the edge from corner k to k + 1 (2D: beyond corner k)
  std::vector<Eigen::Vector3d> m_normals;       ///< of the facets, outwards
  std::vector<std::array<Eigen::Vector3d, 7>> m_pseudo_normals; ///< of facet, its edges and its corners
  std::vector<Eigen::Vector4d> m_balls;                         ///< centre and radius of a ball around each facet
  // Facets within reach of each cell of a grid, and facets across each column of cells along x.
  double m_cell_size = 0.;
  std::array<int, 3> m_cells{{1, 1, 1}};
  Eigen::Vector3d m_grid_lower;
  std::vector<int> m_first_near, m_near;
  std::vector<std::vector<int>> m_columns;
  mutable std::vector<Foot> m_feet;
};
} // namespace kerf::dem
