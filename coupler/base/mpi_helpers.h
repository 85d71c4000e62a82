// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/errors.h"

#include <mpi.h>
#include <string>
#include <vector>

namespace kerf
{
/// Number of this process in @p comm.
inline int rank_of(MPI_Comm comm)
{
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  return rank;
}

/// Runs @p action on the first rank. An error there is thrown on every rank, so that no rank waits for one that gave up: a
/// std::logic_error, which is a bug, as such, all others as InputError. std::invalid_argument is wrong input. Collective.
template <typename Action>
void on_first_rank(MPI_Comm comm, const Action &action)
{
  std::string error;
  int bug = 0;
  if (rank_of(comm) == 0)
  {
    try
    {
      action();
    }
    catch (const std::exception &exception)
    {
      error = error_line(exception);
      bug = is_bug(exception);
      if (error.empty())
        error = "unknown error";
    }
  }
  int length = static_cast<int>(error.size());
  MPI_Bcast(&length, 1, MPI_INT, 0, comm);
  error.resize(length);
  MPI_Bcast(error.data(), length, MPI_CHAR, 0, comm);
  MPI_Bcast(&bug, 1, MPI_INT, 0, comm);
  if (bug)
    throw std::logic_error(error);
  if (length > 0)
    throw InputError(error);
}

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
