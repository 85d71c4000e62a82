// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/calibration/calibrate_case.h"
#include "coupler/application/commands/commands.h"
#include "coupler/application/output/draw_figures.h"
#include "coupler/application/stand_alone/export_case.h"
#include "coupler/application/stand_alone/script_forces.h"
#include "coupler/base/errors.h"

#include <CLI/CLI.hpp>

#include <iostream>
#include <malloc.h>
#include <mpi.h>
#include <stdexcept>

namespace
{
/// Adds what run, check and pack have in common.
void add_case_options(CLI::App &command, kerf::RunOptions &options, std::string &mode, bool with_mode)
{
  command.add_option("case", options.case_directory, "case directory (holds case.prm)")->required();
  command.add_option("--set", options.overrides, "Section/Key=value, overrides the case file")->allow_extra_args(false);
  if (with_mode)
    command.add_option("--mode", mode, "adaptive, fixed, dem or fem (default: Run/Mode of the case)")
      ->check(CLI::IsMember({"adaptive", "fixed", "dem", "fem"}));
}

/// LIGGGHTS reads its own arguments. Its errors end the program; those of the rock bond come on all ranks alike.
int liggghts(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  int rank = 0, code = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  try
  {
    code = kerf::run_liggghts(argc, argv, MPI_COMM_WORLD);
  }
  catch (const std::exception &error)
  {
    if (rank == 0)
      std::cerr << "kerf: " << error.what() << std::endl;
    const bool input = dynamic_cast<const std::invalid_argument *>(&error) != nullptr;
    code = input ? 2 : kerf::is_bug(error) ? 1 : 3;
  }
  MPI_Finalize();
  return code;
}
} // namespace

int main(int argc, char **argv)
{
  // A change of models needs megabytes for a moment: kept, they need not be cleared by the system every time.
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
  if (argc > 1 && std::string(argv[1]) == "liggghts")
    return liggghts(argc - 1, argv + 1);
  CLI::App app("kerf: adaptive coupling of discrete and finite elements for rock cutting");
  kerf::RunOptions options;
  std::string mode;
  bool version = false;
  app.add_flag("--version", version, "versions of kerf and its libraries");
  CLI::App *run = app.add_subcommand("run", "runs a case");
  add_case_options(*run, options, mode, true);
  run->add_option("--output", options.output, "results directory (default: results/<case>)");
  run->add_flag("--overwrite", options.overwrite, "replaces the run that the results directory holds");
  CLI::App *check = app.add_subcommand("check", "validates a case, prints steps, sizes and estimates, runs nothing");
  add_case_options(*check, options, mode, true);
  CLI::App *pack = app.add_subcommand("pack", "generates and calibrates the stored packing of a case");
  add_case_options(*pack, options, mode, false);
  CLI::App *calibrate =
    app.add_subcommand("calibrate", "finds bond stiffnesses and strengths that give the rock's E, nu, UCS and "
                                    "Brazilian strength; writes them into the store");
  add_case_options(*calibrate, options, mode, false);
  CLI::App *write = app.add_subcommand("export", "writes a case in mode dem as LIGGGHTS script with its data");
  add_case_options(*write, options, mode, false);
  write->add_option("--output", options.output, "directory (default: results/<case>_liggghts)");
  write->add_flag("--overwrite", options.overwrite, "replaces the script that the directory holds");
  CLI::App *study = app.add_subcommand("study", "studies of a case's coupling parameters");
  CLI::App *stability = study->add_subcommand(
    "stability", "maps of two coupling parameters each: which settings are stable, dissipative or unstable");
  study->require_subcommand(1);
  add_case_options(*stability, options, mode, false);
  stability->add_option("--output", options.output, "directory (default: results/<case>_stability)");
  stability->add_flag("--overwrite", options.overwrite, "replaces the study that the directory holds");
  app.add_subcommand("liggghts", "runs a LIGGGHTS input script with the rock bond: -in FILE and LIGGGHTS' other options");
  CLI::App *params = app.add_subcommand("params", "prints the reference of all parameters");
  app.require_subcommand(0, 1);
  try
  {
    app.parse(argc, argv);
  }
  catch (const CLI::ParseError &error)
  {
    const int code = app.exit(error);
    return code == 0 ? 0 : 2;
  }

  MPI_Init(&argc, &argv);
  int rank = 0;
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  int code = 0;
  std::string results;
  try
  {
    if (!mode.empty())
      options.mode = kerf::mode_from_name(mode);
    if (version)
      std::cout << (rank == 0 ? kerf::version_text() + "\n" : "");
    else if (*params)
    {
      if (rank == 0)
        kerf::write_parameter_reference(std::cout);
    }
    else if (*check)
      code = kerf::check_case(options, MPI_COMM_WORLD);
    else if (*pack)
      code = kerf::pack_case(options, MPI_COMM_WORLD);
    else if (*calibrate)
      code = kerf::calibrate_case(options, MPI_COMM_WORLD);
    else if (*write)
      code = kerf::export_case(options, MPI_COMM_WORLD);
    else if (*stability)
    {
      if (options.output.empty())
        options.output = options.results_directory() + "_stability";
      code = kerf::study_stability(options, MPI_COMM_WORLD);
      results = options.output;
    }
    else if (*run)
    {
      code = kerf::run_case(options, MPI_COMM_WORLD);
      results = options.results_directory();
    }
    else if (rank == 0)
      std::cout << app.help();
  }
  catch (const kerf::InputError &error)
  {
    if (rank == 0)
      std::cerr << "kerf: " << error.what() << std::endl;
    code = 2;
  }
  catch (const kerf::UnstableRun &error)
  {
    if (rank == 0)
      std::cerr << "kerf: " << error.what() << std::endl;
    code = 3;
  }
  catch (const std::exception &error)
  {
    // On one rank only it would leave the others waiting.
    const bool bug = dynamic_cast<const std::logic_error *>(&error) != nullptr;
    std::cerr << "kerf: rank " << rank << ": " << (bug ? "internal error, a bug of kerf, please report it: " : "")
              << error.what() << std::endl;
    MPI_Abort(MPI_COMM_WORLD, 1);
  }
  MPI_Finalize();
  if (rank == 0 && !results.empty())
    kerf::draw_figures(results); // after MPI has ended: no processes are started beside its threads
  return code;
}
