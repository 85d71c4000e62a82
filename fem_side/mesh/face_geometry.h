// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/element/q1_cell.h"
#include "fem_side/fem_side.h"

namespace kerf::fem
{
/// Reference positions of the nodes of a boundary face [m].
template <int dim>
q1::NodalValues<dim - 1, dim> face_positions(const Mesh &mesh, const BoundaryFace &face)
{
  q1::NodalValues<dim - 1, dim> X;
  for (int a = 0; a < X.cols(); ++a)
    X.col(a) = mesh.nodes.col(face.nodes[a]).template head<dim>();
  return X;
}
} // namespace kerf::fem
