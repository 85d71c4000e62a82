// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/liggghts_instance.h"

#include "dem_side/dem_side.h"

#include <iostream>
#include <universe.h>

namespace kerf::dem
{
std::unique_ptr<LAMMPS> make_liggghts(MPI_Comm comm)
{
  std::string arguments[] = {"kerf", "-screen", "none", "-log", "none"};
  char *argv[5];
  for (int i = 0; i < 5; ++i)
    argv[i] = arguments[i].data();
  return make_liggghts(5, argv, comm);
}

std::unique_ptr<LAMMPS> make_liggghts(int argc, char **argv, MPI_Comm comm)
{
  // Each instance registers all styles once more and LIGGGHTS complains about every one; errors go to stdout and stderr of C.
  std::ostringstream complaints;
  struct Redirection
  {
    std::streambuf *before;
    ~Redirection() { std::cerr.rdbuf(before); }
  } redirection{std::cerr.rdbuf(complaints.rdbuf())};
  return std::make_unique<LAMMPS>(argc, argv, comm);
}

std::string library_version()
{
  static const std::string version = []
  {
    // "Version LIGGGHTS-PUBLIC 3.8.0, compiled ..."
    const std::string text = make_liggghts(MPI_COMM_SELF)->universe->version;
    const auto name = text.find("LIGGGHTS");
    const auto number = text.find(' ', name);
    if (name == std::string::npos || number == std::string::npos)
      return text;
    return "LIGGGHTS" + text.substr(number, text.find(',', number) - number);
  }();
  return version;
}
} // namespace kerf::dem
