// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <memory>
#include <mpi.h>

namespace kerf::dem::benchmarks
{
/// LIGGGHTS as it comes: the spheres of a packing in contact, linear springs with tangential history and Coulomb friction, on
/// the same lists and integrator as kerf's particles.
class StockContacts
{
public:
  /// The packing is compressed by @p overlap (a fraction of the distances) so that neighbours are in contact.
  StockContacts(const Packing &packing, double density, double time_step, double overlap, MPI_Comm comm);
  ~StockContacts();
  void advance(int steps);
  double force_on(int local) const; ///< norm [N]

private:
  struct Engine;
  std::unique_ptr<Engine> engine;
};
} // namespace kerf::dem::benchmarks
