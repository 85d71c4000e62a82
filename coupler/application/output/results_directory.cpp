// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/results_directory.h"

#include "coupler/base/errors.h"

#include <filesystem>

namespace kerf
{
namespace fs = std::filesystem;

void check_results_directory(const std::string &directory, bool overwrite)
{
  if (!fs::exists(directory))
    return;
  if (!fs::is_directory(directory))
    throw InputError(directory + ": is a file, --output needs a directory");
  if (!overwrite && !fs::is_empty(directory))
    throw InputError(directory + ": holds another run, give --overwrite to replace it or --output DIR to keep it");
}

void prepare_results_directory(const std::string &directory, bool overwrite, MPI_Comm comm)
{
  int rank = 0;
  MPI_Comm_rank(comm, &rank);
  if (rank == 0)
  {
    check_results_directory(directory, overwrite);
    if (fs::exists(directory))
      for (const char *name : {"fields", "figures", "fem.pvd", "particles.pvd", "bonds.pvd", "tool.pvd", "history.csv",
                               "history.h5", "activations.csv", "log.txt", "case.prm", "stability.csv"})
        fs::remove_all(directory + "/" + name);
    std::error_code error;
    fs::create_directories(directory, error);
    if (error)
      throw InputError(directory + ": cannot be made, " + error.message());
  }
  MPI_Barrier(comm);
}
} // namespace kerf
