// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <deal.II/distributed/shared_tria.h>

#include <memory>

namespace kerf::fem
{
/// The mesh on every rank. Its cells are divided among the ranks by recursive coordinate bisection, which needs no partitioning
/// library and gives the same result on every machine. Throws std::invalid_argument with one line on settings or files that
/// cannot be used. Collective.
template <int dim>
std::unique_ptr<dealii::parallel::shared::Triangulation<dim>> build_triangulation(MPI_Comm comm, const MeshSettings &settings);
} // namespace kerf::fem
