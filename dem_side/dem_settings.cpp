// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/dem_settings.h"

#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
void check_settings(const Settings &s)
{
  std::ostringstream error;
  const auto positive = [&error](const char *name, double value)
  {
    if (!(value > 0.))
      error << name << " must be positive, not " << value << "; ";
  };
  const auto not_negative = [&error](const char *name, double value)
  {
    if (!(value >= 0.))
      error << name << " must not be negative, not " << value << "; ";
  };
  if (s.packing == nullptr || s.packing->size() == 0)
    throw std::invalid_argument("particles: there is no packing");
  if (s.packing->dim != 2 && s.packing->dim != 3)
    throw std::invalid_argument("particles: the packing must have 2 or 3 dimensions");
  positive("normal stiffness k_n", s.bond.k_n);
  not_negative("tangential stiffness k_t", s.bond.k_t);
  positive("tensile strength R_n", s.bond.R_n);
  positive("shear strength R_t", s.bond.R_t);
  not_negative("friction", s.bond.friction);
  not_negative("contact damping", s.bond.damping);
  not_negative("shear strength friction", s.bond.shear_friction);
  positive("density", s.density);
  positive("time step", s.time_step);
  if (!(s.local_damping >= 0. && s.local_damping < 1.))
    error << "local damping must be in [0, 1), not " << s.local_damping << "; ";
  for (int c = 0; c < s.packing->dim; ++c)
    if (s.packing->periodic[c] == 0. && !(s.domain_lower[c] < s.domain_upper[c]))
      error << "side "
            << "xyz"[c] << " of the particle domain is empty; ";
  if (!error.str().empty())
    throw std::invalid_argument("particles: " + error.str().substr(0, error.str().size() - 2));
}

EngineBox engine_box(const Settings &settings)
{
  const Packing &packing = *settings.packing;
  EngineBox box{settings.domain_lower, settings.domain_upper, {{'f', 'f', 'f'}}};
  for (int c = 0; c < packing.dim; ++c)
    if (packing.periodic[c] > 0.)
    {
      box.lower[c] = packing.lower[c];
      box.upper[c] = packing.lower[c] + packing.periodic[c];
      box.boundary[c] = 'p';
    }
  if (packing.dim == 2)
  {
    box.lower[2] = -packing.mean_diameter;
    box.upper[2] = packing.mean_diameter;
    box.boundary[2] = 'p';
  }
  return box;
}
} // namespace kerf::dem
