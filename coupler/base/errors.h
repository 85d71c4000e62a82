// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <stdexcept>

/// Errors have three kinds. Two of them are declared here; the third one is std::logic_error: a bug of kerf, which no input and
/// no computation should reach.
namespace kerf
{
/// Something that a user can cause and correct. The text is one line: where, what is wrong, what is allowed. Exit code 2.
struct InputError : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// The computation left the physical range; results written so far are kept. Exit code 3.
struct UnstableRun : std::runtime_error
{
  using std::runtime_error::runtime_error;
};

/// Whether an error is a bug of kerf. std::invalid_argument, which the sides throw for wrong input, derives from
/// std::logic_error.
inline bool is_bug(const std::exception &error)
{
  return dynamic_cast<const std::logic_error *>(&error) != nullptr &&
         dynamic_cast<const std::invalid_argument *>(&error) == nullptr;
}
} // namespace kerf
