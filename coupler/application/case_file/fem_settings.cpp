// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/case_file/fem_settings.h"

#include "coupler/loading/surface_resolution.h"

namespace kerf
{
fem::Settings fem_settings(const Case &settings, MPI_Comm comm)
{
  fem::Settings result;
  result.comm = comm;
  result.dim = settings.dim();
  result.mesh = settings.mesh;
  result.material = settings.rock;
  result.strain = settings.strain;
  result.integration = settings.integration;
  result.boundary_conditions = settings.boundary_conditions;
  result.gravity = settings.gravity;
  result.gravity_ramp = settings.gravity_ramp;
  result.initial_stress = settings.initial_stress;
  result.surface_spacing = surface_resolution::point_spacing * settings.packing.mean_diameter;
  return result;
}
} // namespace kerf
