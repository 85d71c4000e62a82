// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/nodal_window.h"

#include <algorithm>

namespace kerf::fem
{
template <int dim>
NodalWindow<dim>::NodalWindow(const NodalSpace<dim> &space, const std::vector<int> &nodes)
{
  std::vector<dealii::types::global_dof_index> dofs;
  for (const int node : nodes)
    for (int c = 0; c < dim; ++c)
      dofs.push_back(space.first_dof(node) + c);
  std::sort(dofs.begin(), dofs.end());
  dealii::IndexSet chosen(space.partitioner->size());
  chosen.add_indices(dofs.begin(), std::unique(dofs.begin(), dofs.end()));
  partitioner = std::make_shared<Partitioner>(space.partitioner->locally_owned_range(), chosen, space.comm);

  for (const int node : nodes)
    positions.push_back(partitioner->global_to_local(space.first_dof(node)));
  ghosts.resize(partitioner->n_ghost_indices());
  packed.resize(partitioner->n_import_indices());
}

template <int dim>
void NodalWindow<dim>::read(const double *owned, Eigen::Matrix3Xd &values) const
{
  const int n_owned = partitioner->locally_owned_size();
  std::vector<MPI_Request> requests;
  partitioner->export_to_ghosted_array_start<double, dealii::MemorySpace::Host>(
    0, dealii::ArrayView<const double>(owned, n_owned), dealii::make_array_view(packed), dealii::make_array_view(ghosts),
    requests);
  partitioner->export_to_ghosted_array_finish<double, dealii::MemorySpace::Host>(dealii::make_array_view(ghosts), requests);

  values.setZero(3, n_nodes());
  for (int i = 0; i < n_nodes(); ++i)
  {
    const double *value = positions[i] < n_owned ? owned + positions[i] : ghosts.data() + (positions[i] - n_owned);
    for (int c = 0; c < dim; ++c)
      values(c, i) = value[c];
  }
}

template <int dim>
void NodalWindow<dim>::add(const Eigen::Matrix3Xd &values, NodalVector &vector) const
{
  const int n_owned = partitioner->locally_owned_size();
  double *owned = vector.begin();
  std::fill(ghosts.begin(), ghosts.end(), 0.);
  for (int i = 0; i < n_nodes(); ++i)
  {
    double *value = positions[i] < n_owned ? owned + positions[i] : ghosts.data() + (positions[i] - n_owned);
    for (int c = 0; c < dim; ++c)
      value[c] += values(c, i);
  }
  std::vector<MPI_Request> requests;
  partitioner->import_from_ghosted_array_start<double, dealii::MemorySpace::Host>(
    dealii::VectorOperation::add, 0, dealii::make_array_view(ghosts), dealii::make_array_view(packed), requests);
  partitioner->import_from_ghosted_array_finish<double, dealii::MemorySpace::Host>(
    dealii::VectorOperation::add, dealii::ArrayView<const double>(packed.data(), packed.size()),
    dealii::ArrayView<double>(owned, n_owned), dealii::make_array_view(ghosts), requests);
}

template class NodalWindow<2>;
template class NodalWindow<3>;
} // namespace kerf::fem
