// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <input.h>
#include <lammps.h>
#include <memory>
#include <mpi.h>
#include <sstream>

namespace kerf::dem
{
using LAMMPS_NS::LAMMPS;

/// A silent LIGGGHTS without a box. Its input errors print and end the program: check before what is passed on.
std::unique_ptr<LAMMPS> make_liggghts(MPI_Comm comm);
/// The same with the arguments of LIGGGHTS' own program; argv[0] is not read.
std::unique_ptr<LAMMPS> make_liggghts(int argc, char **argv, MPI_Comm comm);

/// One line of LIGGGHTS input, numbers with all digits.
template <typename... Items>
void command(LAMMPS &lmp, const Items &...items)
{
  std::ostringstream line;
  line.precision(17);
  (line << ... << items);
  lmp.input->one(line.str().c_str());
}
} // namespace kerf::dem
