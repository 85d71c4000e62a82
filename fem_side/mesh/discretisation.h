// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

#include <deal.II/distributed/shared_tria.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_system.h>

#include <memory>

namespace kerf::fem
{
/// deal.II's part of a NodalSpace. Apart from it because these headers take ten seconds to compile.
template <int dim>
struct Discretisation
{
  /// Builds the mesh; degrees of freedom are not distributed yet. Collective.
  Discretisation(MPI_Comm comm, const MeshSettings &settings);

  std::unique_ptr<dealii::parallel::shared::Triangulation<dim>> triangulation;
  dealii::FESystem<dim> element;
  dealii::DoFHandler<dim> dof_handler;
};
} // namespace kerf::fem
