// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/bond_parameters.h"
#include "dem_side/packing/packing.h"

#include <string>

namespace kerf
{
/// A measured value: mean and standard deviation over the packings.
struct Measured
{
  double mean = 0., scatter = 0.;
};

/// Bond strengths that give packings of one kind the strengths of the rock, and what simulated tests of such packings measured.
/// `kerf calibrate` writes them beside the case, in strengths.txt. They hold for every seed, and for every mean diameter, since
/// a packing of another diameter is the same packing at another scale.
struct Strengths
{
  // The packings, the rock and the bonds that were tested.
  dem::PackingSettings packing;                        ///< without box, surface and seed
  double young = 0., poisson = 0.;                     ///< of the rock [Pa], [-]
  double target_tensile = 0., target_compressive = 0.; ///< strengths of the rock [Pa]
  dem::BondParameters bond;                            ///< R_n, R_t found for the mean diameter; the two frictions
  // Results of the tests.
  double n_packings = 0.;
  Measured tensile, compressive, brazilian;  ///< direct tension, uniaxial compression, flattened disc [Pa]
  Measured specimen_young, specimen_poisson; ///< in the middle of compressed specimens [Pa], [-]

  /// R_n, R_t for another diameter [m]: a bond stands for a section that grows with d^(dim - 1). Theory (11.17).
  dem::BondParameters bond_for(double mean_diameter) const;
};

/// The file of a case directory.
std::string strengths_file(const std::string &directory);

/// Throws InputError with one line when the file is missing or cannot be read.
Strengths load_strengths(const std::string &directory);
void save_strengths(const Strengths &strengths, const std::string &directory);

/// The first difference between two kinds of packing, rock and bonds in words; empty when the strengths of one hold for the
/// other.
std::string difference(const Strengths &known, const Strengths &wanted);
} // namespace kerf
