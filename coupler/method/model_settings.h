// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/tool/tool_settings.h"
#include "coupler/method/activation/activation_settings.h"
#include "coupler/method/constraint/constraint_settings.h"
#include "coupler/method/overlap/overlap_settings.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Which models a run uses.
enum class Mode
{
  adaptive, ///< finite elements everywhere at the start, particles where sigma > sigma*
  fixed,    ///< a predefined particle region
  dem,      ///< particles everywhere
  fem       ///< finite elements only
};

/// All parameters of the coupled model, in SI units. Each part of the method receives the settings that it uses.
struct ModelSettings
{
  fem::Settings body;        ///< rock, mesh, boundary conditions, loads
  dem::BondParameters bond;  ///< bonds of the particles and their contacts
  double local_damping = 0.; ///< Cundall's local damping of the particles [-]
  double mean_diameter = 0.; ///< prescribed mean diameter d of the particles; a packing attains it approximately [m]
  OverlapSettings overlap;
  ConstraintSettings constraint;
  ActivationSettings activation;
  std::vector<Box> fixed_region; ///< particle region of mode fixed
  ToolSettings tool;
};
} // namespace kerf
