// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/generation/container.h"

namespace kerf::dem
{
/// Fills the container with a dense random packing, bonds it and drops loose particles; called by generate_packing(), which
/// checks the settings.
void generate_random(Packing &packing, const PackingSettings &settings, const Container &container, const Progress &progress);

/// Fills the container with a lattice of touching particles: "triangular" (2D, rows along Lattice::row_axis), "fcc" (cube axes
/// along x, y, z) or "hcp" (layers normal to z, rows along x). The block is centred in the bounding box except along periodic
/// axes, where it has no seam, and along x when Lattice::plane_at is given.
void place_lattice(Packing &packing, const Container &container);

/// What of a periodic box does not fit the lattice; empty when it fits.
std::string lattice_misfit(const PackingSettings &settings);

/// Removes particles with fewer than two bonds (again and again) and everything not connected to the main body; a particle on
/// one bond can spin about it freely. Indices of bonds are renewed, the order of particles is kept.
/// @return removed fraction of the particles [-]
double remove_loose_particles(Packing &packing);

/// Shrinks all radii alike until no two particles overlap by more than @p allowed [m].
void remove_overlaps(Packing &packing, double allowed);

/// A particle without hold in its cage (rattler) is moved to the middle of the cage and grown, to @p largest_radius at most,
/// until it touches.
void hold_rattlers(Packing &packing, const Container &container, double largest_radius);
} // namespace kerf::dem
