// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <input.h>
#include <lammps.h>
#include <memory>
#include <mpi.h>
#include <sstream>
#include <streambuf>

namespace kerf::dem
{
using LAMMPS_NS::LAMMPS;

/// Discards the output to std::cerr while it exists. Each instance of LIGGGHTS registers all styles once more and warns about
/// every one of them. Errors of LIGGGHTS go to stdout and stderr of C and stay visible.
class StyleWarningsOff
{
public:
  StyleWarningsOff();
  ~StyleWarningsOff();
  StyleWarningsOff(const StyleWarningsOff &) = delete;
  StyleWarningsOff &operator=(const StyleWarningsOff &) = delete;

private:
  std::ostringstream discarded;
  std::streambuf *const before;
};

/// A silent LIGGGHTS without a box. Its input errors print and end the program, so check the input beforehand.
std::unique_ptr<LAMMPS> make_liggghts(MPI_Comm comm);

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
