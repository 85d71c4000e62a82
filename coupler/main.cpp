// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/output/draw_figures.h"
#include "coupler/application/stand_alone/script_forces.h"
#include "coupler/base/errors.h"
#include "coupler/command_line.h"

#include <iostream>
#include <malloc.h>
#include <mpi.h>

namespace
{
/// LIGGGHTS reads its own arguments. Its errors end the program; those of the rock bond come on all ranks alike.
int liggghts(int argc, char **argv)
{
  int rank = 0, code = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  try
  {
    code = kerf::run_liggghts(argc, argv, MPI_COMM_WORLD);
  }
  catch (const std::exception &error)
  {
    if (rank == 0)
      std::cerr << "kerf: " << kerf::error_line(error) << std::endl;
    const bool input = dynamic_cast<const std::invalid_argument *>(&error) != nullptr;
    code = input ? 2 : kerf::is_bug(error) ? 1 : 3;
  }
  return code;
}
} // namespace

int main(int argc, char **argv)
{
  // A change of models needs megabytes for a moment: kept, they need not be cleared by the system every time.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  MPI_Init(&argc, &argv);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  kerf::Ending ending;
  if (argc > 1 && std::string(argv[1]) == "liggghts")
    ending.code = liggghts(argc - 1, argv + 1);
  else
    ending = kerf::run_command_line({argv + 1, argv + argc}, MPI_COMM_WORLD);
  int n_ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  const bool draws = rank == 0 && !ending.results.empty(), killed_soon = ending.code == 130 && n_ranks > 1;
  if (draws && killed_soon)
    kerf::draw_figures(ending.results, true);
  MPI_Finalize();
  if (draws && !killed_soon)
    kerf::draw_figures(ending.results); // after MPI has ended: no processes are started beside its threads
  return ending.code;
}
