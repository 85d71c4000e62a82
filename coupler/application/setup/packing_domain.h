// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/base/mesh_geometry.h"

#include <memory>

namespace kerf
{
/// What the stored packing of a case fills.
struct PackingDomain
{
  Box box;                                         ///< around it [m]
  double volume = 0.;                              ///< [m^3] (2D: [m^2])
  std::shared_ptr<const dem::SurfaceMesh> surface; ///< empty: the whole box
};

/// The surface file of the case, else the boundary of the mesh, or its box when the mesh fills that. Throws InputError.
PackingDomain find_packing_domain(const Case &settings, const fem::Mesh &mesh);
} // namespace kerf
