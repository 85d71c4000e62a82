// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/application/output/specimen_gauge.h"
#include "coupler/base/mesh_geometry.h"

#include <memory>

namespace kerf
{
/// The region that the stored packing of a case fills.
struct PackingDomain
{
  Box box;                                         ///< bounding box [m]
  double volume = 0.;                              ///< [m^3] (2D: [m^2])
  std::shared_ptr<const dem::SurfaceMesh> surface; ///< empty: the region is the box
  std::vector<double> shape;                       ///< moments of the surface; empty: the region is the box
};

/// The region inside the surface file of the case. Without a file it is the region of the mesh, as a box if the mesh is a box.
/// Throws InputError.
PackingDomain find_packing_domain(const Case &settings, const fem::Mesh &mesh);

/// The body between platens: in mode dem what the packing fills, otherwise the mesh. Throws InputError.
Specimen find_specimen(const Case &settings, const fem::Mesh &mesh, Mode mode);
} // namespace kerf
