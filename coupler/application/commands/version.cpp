// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/commands/commands.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <hdf5.h>

namespace kerf
{
std::string version_text()
{
  char mpi[MPI_MAX_LIBRARY_VERSION_STRING] = "";
  int length = 0;
  MPI_Get_library_version(mpi, &length);
  std::string mpi_text(mpi, length);
  mpi_text = mpi_text.substr(0, mpi_text.find_first_of(",\n"));
  unsigned major = 0, minor = 0, release = 0;
  H5get_libversion(&major, &minor, &release);
  return "kerf " KERF_VERSION "\n" + fem::library_version() + "\n" + dem::library_version() + "\n" + mpi_text + "\nHDF5 " +
         std::to_string(major) + "." + std::to_string(minor) + "." + std::to_string(release);
}
} // namespace kerf
