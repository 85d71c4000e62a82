// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/rock_bond_style.h"

#include <string>

namespace kerf::dem
{
/// Makes the rock bond the pair style of @p lmp, whose box exists already. LIGGGHTS owns the result.
RockBondStyle &install_rock_bond(LAMMPS_NS::LAMMPS &lmp, const RockBondParameters &parameters);

/// The rock bond that computes the pair forces of @p lmp, or nullptr when its pair style is another one.
RockBondStyle *find_rock_bond(LAMMPS_NS::LAMMPS &lmp);

/// Makes a kind of rock bond known to LIGGGHTS as `pair_style gran model NAME`. To be called once in a program for each name.
/// @param id of the model; LIGGGHTS' own end at 9, and there are six bits
void register_rock_bond(const char *name, int id,
                        LIGGGHTS::PairStyles::IGranularPairStyle *(*create)(LAMMPS_NS::LAMMPS *, LAMMPS_NS::PairGran *,
                                                                            std::int64_t hash));

/// Adds the fixes that keep rotation, weight and number of broken bonds of each particle, if they do not exist yet. The rock
/// bond needs them when it is constructed. @return whether they were added
bool add_particle_properties(LAMMPS_NS::LAMMPS &lmp);

/// Adds the fix of a line of input without its first word. An input line would overwrite the words of the one that LIGGGHTS is
/// reading while it creates a pair style.
void add_fix(LAMMPS_NS::LAMMPS &lmp, const std::string &line);
} // namespace kerf::dem
