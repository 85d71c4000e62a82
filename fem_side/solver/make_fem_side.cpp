// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/explicit_solver.h"

#include <deal.II/base/multithread_info.h>

#include <stdexcept>

namespace kerf::fem
{
namespace
{
void check_material(const Material &material)
{
  if (!(material.density > 0.))
    throw std::invalid_argument("rock: the density must be positive");
  if (!(material.young > 0.))
    throw std::invalid_argument("rock: Young's modulus must be positive");
  if (!(material.poisson > -1. && material.poisson < 0.5))
    throw std::invalid_argument("rock: Poisson's ratio must lie between -1 and 0.5");
}
} // namespace

std::unique_ptr<FemSide> make_fem_side(const Settings &settings)
{
  check_material(settings.material);
  dealii::MultithreadInfo::set_thread_limit(1); // ranks are the only parallelism
  if (settings.dim == 2)
    return std::make_unique<ExplicitSolver<2>>(settings);
  if (settings.dim == 3)
    return std::make_unique<ExplicitSolver<3>>(settings);
  throw std::invalid_argument("dimension: must be 2 or 3");
}

std::string library_version()
{
  return "deal.II " DEAL_II_PACKAGE_VERSION;
}
} // namespace kerf::fem
