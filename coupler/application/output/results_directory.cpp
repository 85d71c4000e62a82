// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/results_directory.h"

#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"

#include <algorithm>
#include <filesystem>
#include <fstream>

namespace kerf
{
namespace fs = std::filesystem;

namespace
{
/// Only what lies beside this file is replaced: it says that kerf made the directory.
constexpr const char *mark = ".kerf_results";

/// Whether @p inner is @p outer or lies somewhere in it.
bool lies_in(const fs::path &inner, const fs::path &outer)
{
  const fs::path in = fs::weakly_canonical(inner), out = fs::weakly_canonical(outer);
  return std::mismatch(out.begin(), out.end(), in.begin(), in.end()).first == out.end();
}
} // namespace

void check_results_directory(const std::string &directory, const std::string &case_directory, bool overwrite)
{
  if (!fs::exists(directory))
    return;
  if (!fs::is_directory(directory))
    throw InputError(directory + ": is a file, --output needs a directory");
  if (lies_in(case_directory, directory))
    throw InputError(directory + ": holds the case itself, give --output another directory");
  if (fs::is_empty(directory))
    return;
  if (!fs::exists(fs::path(directory) / mark))
    throw InputError(directory + ": holds files that are no results of kerf (no " + mark +
                     " in it), give --output a new or empty directory");
  if (!overwrite)
    throw InputError(directory + ": holds results of kerf, give --overwrite to replace them or --output DIR to keep them");
}

void prepare_results_directory(const std::string &directory, const std::string &case_directory, bool overwrite, MPI_Comm comm)
{
  on_first_rank(
    comm,
    [&]
    {
      check_results_directory(directory, case_directory, overwrite);
      if (fs::exists(directory))
        for (const char *name :
             {"fields", "figures", "fem.pvd", "particles.pvd", "bonds.pvd", "tool.pvd", "history.csv", "history.h5",
              "activations.csv", "log.txt", "case.prm", "stability.csv", "in.kerf", "particles.data"})
          fs::remove_all(directory + "/" + name);
      std::error_code error;
      fs::create_directories(directory, error);
      if (error)
        throw InputError(directory + ": cannot be made, " + error.message());
      if (!(std::ofstream(fs::path(directory) / mark) << "kerf wrote the results beside this file and may replace them\n"))
        throw InputError(directory + ": cannot be written to");
    });
}
} // namespace kerf
