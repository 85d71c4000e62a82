// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/errors.h"

#include <cerrno>
#include <cstring>
#include <ostream>

namespace kerf
{
/// Throws InputError when what was put into @p file has not arrived at @p path, for example on a full disk.
inline void check_written(std::ostream &file, const std::string &path)
{
  errno = 0;
  if (!file.flush())
    throw InputError(path + ": cannot be written, " + std::strerror(errno != 0 ? errno : ENOSPC));
}
} // namespace kerf
