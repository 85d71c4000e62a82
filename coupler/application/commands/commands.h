// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"

#include <mpi.h>
#include <optional>
#include <string>
#include <vector>

namespace kerf
{
struct RunOptions
{
  std::string case_directory;
  std::optional<Mode> mode; ///< empty: the case's own
  std::vector<Override> overrides;
  std::string output; ///< empty: results/<case>, or results/<case>_<mode> for a mode that is not the case's own
  bool overwrite = false;

  std::string results_directory() const;
};

/// kerf run. Returns the exit code: 0, or 128 + signal after an interrupt with everything written. Collective.
int run_case(const RunOptions &options, MPI_Comm comm);

/// kerf check: validates, prints what a run would be. Collective.
int check_case(const RunOptions &options, MPI_Comm comm);

/// kerf pack: generates and calibrates the store. Collective.
int pack_case(const RunOptions &options, MPI_Comm comm);

/// kerf calibrate: elastic part, then bond strengths from simulated tests, into the store. Collective; ranks share the tests.
int calibrate_case(const RunOptions &options, MPI_Comm comm);
/// kerf export: writes the case in mode dem as script and data file for kerf liggghts. Collective.
int export_case(const RunOptions &options, MPI_Comm comm);

/// kerf liggghts: a LIGGGHTS input script with the rock bond and the forces of kerf export. @param argv arguments of LIGGGHTS
/// after the name of the program. Collective.
int run_liggghts(int argc, char **argv, MPI_Comm comm);

/// kerf study stability: perturbs the case's overlap at many settings, each with one map of two parameters; writes
/// stability.csv. Collective.
int study_stability(const RunOptions &options, MPI_Comm comm);

/// Name and versions of kerf and its libraries, one a line.
std::string version_text();
} // namespace kerf
