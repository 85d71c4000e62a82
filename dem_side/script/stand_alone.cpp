// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/script/stand_alone.h"

#include "dem_side/script/script_fixes.h"
#include "dem_side/script/script_rock_bond.h"

#include <csignal>
#include <cstdio>
#include <input.h>
#include <signal_handling.h>

namespace kerf::dem
{
namespace
{
/// LIGGGHTS ends a run at the next step when it is interrupted, as its own program does.
void end_runs_on_signals()
{
  struct sigaction quit = {}, write = {};
  quit.sa_handler = LAMMPS_NS::SignalHandler::int_handler;
  write.sa_handler = LAMMPS_NS::SignalHandler::usr1_handler;
  sigaction(SIGINT, &quit, nullptr);
  sigaction(SIGTERM, &quit, nullptr); // mpirun passes an interrupt on as this signal
  sigaction(SIGUSR1, &write, nullptr);
}
} // namespace

void run_script(int argc, char **argv, MPI_Comm comm, const std::map<std::string, ScriptForceMaker> &forces)
{
  end_runs_on_signals();
  register_script_rock_bond();
  const auto lmp = make_script_liggghts(argc, argv, comm, forces);
  try
  {
    lmp->input->file();
  }
  catch (const std::exception &error)
  {
    if (lmp->logfile != nullptr)
      std::fprintf(lmp->logfile, "ERROR: %s\n", error.what());
    throw;
  }
}
} // namespace kerf::dem
