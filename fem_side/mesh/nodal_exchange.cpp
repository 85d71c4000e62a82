// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/nodal_exchange.h"

#include <deal.II/base/partitioner.h>

#include <algorithm>

namespace kerf::fem
{
namespace
{
using Partitioner = dealii::Utilities::MPI::Partitioner;

std::shared_ptr<const Partitioner> with_copies(const Partitioner &owners, std::vector<std::uint64_t> components)
{
  std::sort(components.begin(), components.end());
  dealii::IndexSet chosen(owners.size());
  chosen.add_indices(components.begin(), std::unique(components.begin(), components.end()));
  return std::make_shared<Partitioner>(owners.locally_owned_range(), chosen, owners.get_mpi_communicator());
}
} // namespace

NodalExchange::NodalExchange(std::shared_ptr<const Partitioner> partitioner_in)
  : partitioner(std::move(partitioner_in)), owned_size(static_cast<int>(partitioner->locally_owned_size())),
    copied_size(static_cast<int>(partitioner->n_ghost_indices())), buffer(partitioner->n_import_indices())
{
}

NodalExchange::NodalExchange(const NodalExchange &owners, std::vector<std::uint64_t> components)
  : NodalExchange(with_copies(*owners.partitioner, std::move(components)))
{
}

bool NodalExchange::has(const std::uint64_t component) const
{
  return partitioner->in_local_range(component) || partitioner->is_ghost_entry(component);
}

int NodalExchange::position(const std::uint64_t component) const
{
  return static_cast<int>(partitioner->global_to_local(component));
}

void NodalExchange::update_copies(const double *owned, double *copies) const
{
  const dealii::ArrayView<double> copied(copies, copied_size);
  std::vector<MPI_Request> requests;
  partitioner->export_to_ghosted_array_start<double, dealii::MemorySpace::Host>(
    0, dealii::ArrayView<const double>(owned, owned_size), dealii::ArrayView<double>(buffer.data(), buffer.size()), copied,
    requests);
  partitioner->export_to_ghosted_array_finish<double, dealii::MemorySpace::Host>(copied, requests);
}

void NodalExchange::add_copies(double *copies, double *owned) const
{
  const dealii::ArrayView<double> copied(copies, copied_size);
  std::vector<MPI_Request> requests;
  partitioner->import_from_ghosted_array_start<double, dealii::MemorySpace::Host>(
    dealii::VectorOperation::add, 0, copied, dealii::ArrayView<double>(buffer.data(), buffer.size()), requests);
  partitioner->import_from_ghosted_array_finish<double, dealii::MemorySpace::Host>(
    dealii::VectorOperation::add, dealii::ArrayView<const double>(buffer.data(), buffer.size()),
    dealii::ArrayView<double>(owned, owned_size), copied, requests);
}
} // namespace kerf::fem
