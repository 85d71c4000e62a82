// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/run_options.h"
#include "coupler/loading/boundary/particle_boundary.h"

namespace kerf
{
/// A case in mode dem as input of LIGGGHTS without coupling (kerf liggghts).
struct ScriptContents
{
  const Case &settings; ///< with k_n, k_t of the store packing_file
  const dem::Packing &packing;
  const ParticleBoundary &boundary;
  dem::Settings particles; ///< gives time step, density and domain
  std::int64_t n_steps = 0;
  std::string tool_case; ///< directory of the case.prm with the tool, relative to the script; empty: no tool
};

constexpr const char *script_name = "in.kerf";

/// Writes the script, particles.data and areas of absorbing sides into the existing directory @p directory. Paths in the script
/// are relative to it. Throws InputError.
void write_script(const ScriptContents &contents, const std::string &directory);

/// kerf export: writes the case in mode dem as script and data file for kerf liggghts. Throws InputError. Collective.
int export_case(const RunOptions &options, MPI_Comm comm);
} // namespace kerf
