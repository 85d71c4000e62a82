// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <mpi.h>
#include <vector>

namespace kerf
{
/// Concatenates the lists of all ranks. Collective.
template <typename Number>
std::vector<Number> gather_all(const std::vector<Number> &local, MPI_Datatype type, MPI_Comm comm)
{
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  const int n = static_cast<int>(local.size());
  std::vector<int> counts(n_ranks), offsets(n_ranks, 0);
  MPI_Allgather(&n, 1, MPI_INT, counts.data(), 1, MPI_INT, comm);
  for (int r = 1; r < n_ranks; ++r)
    offsets[r] = offsets[r - 1] + counts[r - 1];
  std::vector<Number> all(offsets.back() + counts.back());
  MPI_Allgatherv(local.data(), n, type, all.data(), counts.data(), offsets.data(), type, comm);
  return all;
}
} // namespace kerf
