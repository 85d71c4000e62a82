// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/generation/container.h"

namespace kerf::dem
{
/// The steps of generate_packing(), which checks the settings.
///
/// Fills the container with a dense random packing, bonds it and removes unconnected particles.
void generate_random(Packing &packing, const PackingSettings &settings, const Container &container, const Progress &progress);

/// Fills the container with a lattice of touching particles: "triangular" (2D, rows along Lattice::row_axis), "fcc" (cube axes
/// along x, y, z) or "hcp" (layers normal to z, rows along x). The block is centred in the bounding box, except along periodic
/// axes, which it fills, and along x when Lattice::plane_at is set.
void place_lattice(Packing &packing, const Container &container);

/// Names the side of a periodic box that does not fit the lattice. Empty when the box fits.
std::string lattice_misfit(const PackingSettings &settings);

/// Removes particles with fewer than two bonds, until there are none, and then all particles that are not connected to the
/// largest body. (A particle with one bond rotates freely about it.) The bonds get the new indices; the order of particles is
/// kept.
/// @return removed fraction of the particles [-]
double remove_unconnected_particles(Packing &packing);

/// Scales all radii by one factor so that no two particles overlap by more than @p allowed [m].
void remove_overlaps(Packing &packing, double allowed);

/// Moves a particle without contacts in its cage (rattler) to the middle of the cage and increases its radius until it touches,
/// up to @p largest_radius [m].
void hold_rattlers(Packing &packing, const Container &container, double largest_radius);
} // namespace kerf::dem
