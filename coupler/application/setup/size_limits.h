// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"

namespace kerf
{
/// Memory of a run by its parts [bytes], measured on runs of 4e4 to 2e5 particles and cells (GCC, 64 bit). In two and three
/// dimensions, which differ in the number of bonds and nodes.
double bytes_of_program();
double bytes_of_cell(int dim);
double bytes_of_particle(int dim); ///< active, with bonds and neighbour lists; a generation takes less
double bytes_of_stored_particle();

/// Number of cells that the section Mesh asks for, before any is made, within a factor of about two. With a mesh file it is an
/// upper bound.
double estimate_cells(const Case &settings);

/// Number of particles that fill the volume @p volume [m^3] (2D: [m^2]).
double estimate_particles(const dem::PackingSettings &packing, double volume);

/// Memory that this machine can give now [bytes]: what is free, within the limits of the process and of its control group.
double available_memory();

/// Throw InputError when the mesh, the contact points of a mesh without file, or @p n_particles active particles need more
/// memory than there is, unless the case is forced, or more than can be numbered. @param n_ranks processes of this machine
void check_mesh_size(const Case &settings, int n_ranks);
void check_contact_points(const Case &settings, int n_ranks);
void check_particle_number(const Case &settings, double n_particles, int n_ranks);
} // namespace kerf
