// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/command_line.h"

#include "coupler/application/calibration/calibrate_case.h"
#include "coupler/application/stand_alone/export_case.h"
#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <iostream>
#include <unistd.h>

namespace kerf
{
namespace
{
/// Time that ranks with an error wait for the others [s]. Ranks that find the same error differ by less.
constexpr double patience = 10.;

/// The words of the command line.
struct Words
{
  RunOptions options;
  std::string mode;
  bool version = false;
};

/// Adds what run, check and pack have in common.
void add_case_options(CLI::App &command, Words &words, bool with_mode)
{
  command.add_option("case", words.options.case_directory, "case directory (holds case.prm)")->required();
  command.add_option("--set", words.options.overrides, "Section/Key=value, overrides the case file")->allow_extra_args(false);
  command.add_flag("--force", words.options.force, "goes on when cells and particles seem to need more memory than there is");
  if (with_mode)
    command.add_option("--mode", words.mode, "adaptive, fixed, dem or fem (default: Run/Mode of the case)")
      ->check(CLI::IsMember({"adaptive", "fixed", "dem", "fem"}));
}

void add_output_options(CLI::App &command, Words &words, const std::string &place, const std::string &thing)
{
  command.add_option("--output", words.options.output, "directory (default: results/" + place + ")");
  command.add_flag("--overwrite", words.options.overwrite, "replaces the " + thing + " that the directory holds");
}

/// Reads the command line and calls the command.
Ending run_command(const std::vector<std::string> &arguments, MPI_Comm comm)
{
  CLI::App app("kerf: adaptive coupling of discrete and finite elements for rock cutting", "kerf");
  Words words;
  app.add_flag("--version", words.version, "versions of kerf and its libraries");
  CLI::App *run = app.add_subcommand("run", "runs a case");
  add_case_options(*run, words, true);
  add_output_options(*run, words, "<case>", "run");
  CLI::App *check = app.add_subcommand("check", "validates a case, prints steps, sizes and estimates, runs nothing");
  add_case_options(*check, words, true);
  check->add_flag("--pack", words.options.pack, "generates the store when it is missing");
  CLI::App *pack = app.add_subcommand("pack", "generates and calibrates the stored packing of a case");
  add_case_options(*pack, words, false);
  CLI::App *calibrate =
    app.add_subcommand("calibrate", "finds bond strengths that give the rock's compressive and direct tensile strength; "
                                    "writes them into strengths.txt beside the case");
  add_case_options(*calibrate, words, false);
  CLI::App *write = app.add_subcommand("export", "writes a case in mode dem as LIGGGHTS script with its data");
  add_case_options(*write, words, false);
  add_output_options(*write, words, "<case>_liggghts", "script");
  CLI::App *study = app.add_subcommand("study", "studies of a case's coupling parameters");
  CLI::App *stability = study->add_subcommand(
    "stability", "maps of two coupling parameters each: which settings are stable, dissipative or unstable");
  study->require_subcommand(1);
  add_case_options(*stability, words, false);
  add_output_options(*stability, words, "<case>_stability", "study");
  app.add_subcommand("liggghts", "runs a LIGGGHTS input script with the rock bond: -in FILE and LIGGGHTS' other options");
  CLI::App *params = app.add_subcommand("params", "prints the reference of all parameters");
  app.require_subcommand(0, 1);

  const bool first = rank_of(comm) == 0;
  try
  {
    app.parse(std::vector<std::string>(arguments.rbegin(), arguments.rend())); // CLI11 reads words from the back
  }
  catch (const CLI::ParseError &error)
  {
    if (error.get_exit_code() != 0)
      throw InputError("command line: " + std::string(error.what()) + "; words and options: kerf --help, kerf run --help");
    if (first)
      app.exit(error);
    return {};
  }

  RunOptions &options = words.options;
  if (!words.mode.empty())
    options.mode = mode_from_name(words.mode);
  if (words.version)
    std::cout << (first ? version_text() + "\n" : "") << std::flush;
  else if (*params)
  {
    if (first)
      write_parameter_reference(std::cout);
  }
  else if (*check)
    return {check_case(options, comm), "", ""};
  else if (*pack)
    return {pack_case(options, comm), "", ""};
  else if (*calibrate)
    return {calibrate_case(options, comm), "", ""};
  else if (*write)
    return {export_case(options, comm), "", ""};
  else if (*stability)
  {
    if (options.output.empty())
      options.output = options.results_directory() + "_stability";
    return {study_stability(options, comm), options.output, ""};
  }
  else if (*run)
    return run_case(options, comm);
  else if (first)
    std::cout << app.help();
  return {};
}

/// The largest exit code of all ranks, and whether the first rank has an error. A rank with an error does not wait for ever.
/// Without an answer there is none.
struct Agreement
{
  bool reached = true;
  int code = 0;
  bool first_rank_failed = false;
};

Agreement agree(int code, MPI_Comm comm)
{
  int mine[2] = {code, rank_of(comm) == 0 && code != 0}, all[2] = {0, 0}, done = 0;
  MPI_Request request;
  MPI_Iallreduce(mine, all, 2, MPI_INT, MPI_MAX, comm, &request);
  for (const double start = MPI_Wtime(); MPI_Test(&request, &done, MPI_STATUS_IGNORE), !done;)
  {
    if (code != 0 && MPI_Wtime() - start > patience)
      return {false, code, false};
    usleep(1000);
  }
  return {true, all[0], all[1] != 0};
}
} // namespace

Ending run_command_line(const std::vector<std::string> &arguments, MPI_Comm comm)
{
  MPI_Comm agreement_comm = MPI_COMM_NULL; // ranks may wait in collective calls on the other one
  MPI_Comm_dup(comm, &agreement_comm);
  const int rank = rank_of(comm);
  Ending ending;
  std::string failure;
  try
  {
    ending = run_command(arguments, comm);
    failure = ending.failure;
    std::cout << std::flush;
    if (rank == 0 && !std::cout)
      throw InputError("standard output cannot be written, is the disk full?");
  }
  catch (const std::exception &error)
  {
    ending.code = exit_code(error);
    failure = (ending.code == 1 ? "internal error, a bug of kerf, please report it: " : "") + error_line(error);
  }
  if (rank == 0 && !failure.empty())
    std::cerr << "kerf: " << failure << std::endl;
  const Agreement agreement = agree(ending.code, agreement_comm);
  if (rank != 0 && !failure.empty() && !agreement.first_rank_failed)
    std::cerr << "kerf: rank " << rank << ": " << failure << std::endl;
  if (!agreement.reached)
    MPI_Abort(comm, ending.code);
  ending.code = agreement.code;
  MPI_Comm_free(&agreement_comm);
  return ending;
}
} // namespace kerf
