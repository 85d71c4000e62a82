// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/liggghts_instance.h"

#include <iostream>
#include <string>

namespace kerf::dem
{
StyleWarningsOff::StyleWarningsOff() : before(std::cerr.rdbuf(discarded.rdbuf())) {}

StyleWarningsOff::~StyleWarningsOff()
{
  std::cerr.rdbuf(before);
}

std::unique_ptr<LAMMPS> make_liggghts(MPI_Comm comm)
{
  std::string arguments[] = {"kerf", "-screen", "none", "-log", "none"};
  char *argv[5];
  for (int i = 0; i < 5; ++i)
    argv[i] = arguments[i].data();
  const StyleWarningsOff quiet;
  return std::make_unique<LAMMPS>(5, argv, comm);
}
} // namespace kerf::dem
