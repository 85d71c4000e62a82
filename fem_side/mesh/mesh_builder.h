// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <deal.II/distributed/shared_tria.h>

#include <memory>

namespace kerf::fem
{
/// The mesh on every rank, its cells divided among the ranks by recursive coordinate bisection (needs no partitioning library
/// and gives the same answer everywhere). Throws std::runtime_error with one line on settings or files that cannot be used.
/// Collective.
template <int dim>
std::unique_ptr<dealii::parallel::shared::Triangulation<dim>> build_triangulation(MPI_Comm comm, const MeshSettings &settings);
} // namespace kerf::fem
