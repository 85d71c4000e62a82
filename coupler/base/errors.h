// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <stdexcept>
#include <string>

namespace kerf
{
/// Something that a user can cause and mend; the text is one line: where, what is wrong, what is allowed. Exit code 2.
struct InputError : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// The computation left the physical range; what was written so far is kept. Exit code 3.
struct UnstableRun : std::runtime_error
{
  using std::runtime_error::runtime_error;
};
} // namespace kerf
