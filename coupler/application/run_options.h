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
  std::optional<Mode> mode; ///< empty: the mode of the case
  std::vector<Override> overrides;
  std::string output; ///< empty: results/CASE, or results/CASE_MODE when @p mode differs from that of the case
  bool overwrite = false;
  bool force = false; ///< goes on when the estimated memory exceeds that of the machine
  bool pack = false;  ///< check: generates a missing store

  std::string results_directory() const;
  /// The case with these options. Throws InputError.
  Case read() const { return read(overrides); }
  Case read(const std::vector<Override> &with) const
  {
    Case settings = read_case(case_directory, with);
    settings.force = force;
    return settings;
  }
};
} // namespace kerf
