// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <fix.h>
#include <lammps.h>
#include <string>

namespace kerf::dem
{
using FixMaker = LAMMPS_NS::Fix *(*)(LAMMPS_NS::LAMMPS *, int n_words, char **words);

/// Makes a style of fix known to an instance of LIGGGHTS.
void register_fix(LAMMPS_NS::LAMMPS &lmp, const std::string &style, FixMaker maker);

template <typename Style>
LAMMPS_NS::Fix *make_fix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words)
{
  return new Style(lmp, n_words, words);
}
} // namespace kerf::dem
