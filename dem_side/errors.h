// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <stdexcept>

/// Errors of the particle side. Besides the one below: std::invalid_argument for wrong input of the user (files, script lines,
/// settings), std::logic_error for misuse of an interface, std::runtime_error for files that cannot be written and for
/// numerical methods that fail. std::invalid_argument derives from std::logic_error, so it must be caught first.
namespace kerf::dem
{
/// The particles ran away: an intact bond far beyond its strength, a particle out of its domain or without a finite state. The
/// usual reason is a time step that is too large.
struct Unstable : std::runtime_error
{
  using std::runtime_error::runtime_error;
};
} // namespace kerf::dem
