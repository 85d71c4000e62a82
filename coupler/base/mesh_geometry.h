// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <Eigen/Geometry>
#include <vector>

namespace kerf
{
/// Box along the axes [m].
struct Box
{
  Eigen::Vector3d lower, upper;
};

/// Box that the mesh fills, in the reference configuration.
Box mesh_box(const fem::Mesh &mesh);

/// Mean of the corners of a cell [m].
Eigen::Vector3d cell_centre(const fem::Mesh &mesh, int cell);

/// Smallest box along the axes around a cell: its distance from a point is a cheap lower bound.
Eigen::AlignedBox3d cell_box(const fem::Mesh &mesh, int cell);

/// Distance [m] of @p point from a mesh cell, zero inside (convex quadrilateral or hexahedron).
double distance_to_cell(const fem::Mesh &mesh, int cell, const Eigen::Vector3d &point);

/// Distance [m] of @p point from a face of the boundary (2D: segment).
double distance_to_face(const fem::Mesh &mesh, const fem::BoundaryFace &face, const Eigen::Vector3d &point);

/// Cells whose centre lies in one of the boxes, ascending.
std::vector<int> cells_inside(const fem::Mesh &mesh, const std::vector<Box> &boxes);
} // namespace kerf
