// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"

#include <optional>
#include <string>
#include <vector>

namespace kerf
{
/// Options of the command line that the commands share.
struct RunOptions
{
  std::string case_directory;
  std::optional<Mode> mode; ///< empty: the case's own
  std::vector<Override> overrides;
  std::string output; ///< empty: results/CASE, or results/CASE_MODE for a mode that is not the case's own
  bool overwrite = false;

  std::string results_directory() const;
};
} // namespace kerf
