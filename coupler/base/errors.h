// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <stdexcept>
#include <string>

/// Errors have three kinds. Two of them are declared here; the third one is a bug of kerf, which no input and no computation
/// should reach.
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

/// The exit code of the program that an error ends: 3 for UnstableRun, 2 for all that a user or the machine causes (wrong
/// input, files, memory), 1 for a bug.
int exit_code(const std::exception &error);

/// The text of an error as one line. Errors of the system name the file first.
std::string error_line(const std::exception &error);

/// A text of the user for a message: one line of at most @p most characters, those that cannot be printed as '?'.
std::string shown(const std::string &text, std::size_t most = 80);
} // namespace kerf
