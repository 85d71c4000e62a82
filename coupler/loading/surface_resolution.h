// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

/// How finely contact with the surface of the finite elements is resolved. All lengths are in mean particle diameters d: the
/// contact has the scale of a particle on both sides of the coupling, whatever the size of the cells.
namespace kerf::surface_resolution
{
/// Spacing of the surface points at which the finite elements feel a contact. It is small against a particle: between coarse
/// points a round tool or a particle would sink in before any point is met.
constexpr double point_spacing = 0.25;

/// A surface point stands for a flat patch around it with this radius. The patches have to cover the surface without holes. The
/// points are Gauss points, two along each part of a face of at most twice the spacing, so neighbours are up to
/// 2/sqrt(3) x 0.25 d = 0.289 d apart. Half of that covers a line (0.144 d), half the diagonal of the square a plane (0.204 d).
constexpr double patch_radius(int dim)
{
  return dim == 2 ? 0.15 : 0.21;
}

/// With a given stiffness ratio the surface resists a tool like a layer of particles, one on each such length (two dimensions)
/// or its square (three). One diameter is the distance of touching particles.
constexpr double particle_spacing = 1.;
} // namespace kerf::surface_resolution
