// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_parameters.h"

#include <string>

namespace kerf::dem
{
/// Parameters of the rock bond in a LIGGGHTS script: the words after `pair_style gran model kerf_rock_bond`.
struct RockBondLine
{
  BondParameters bond;
  double local_damping = 0.; ///< [-]
  std::string store;         ///< HDF5 store with the bonds; empty: contacts only
};

/// Pairs of key and value: k_n, k_t [N/m], R_n, R_t [N], shear_friction, friction, damping, local_damping [-], store FILE. k_n
/// and k_t are required, with a store also R_n and R_t. Throws std::invalid_argument with one line that names the error and the
/// allowed values.
RockBondLine parse_rock_bond_line(int n_words, const char *const *words);
} // namespace kerf::dem
