// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/case_file.h"

#include <Eigen/Core>

namespace kerf
{
/// Stress measure [Pa] that is compared with sigma* (seed, eq. 5), from a Cauchy stress xx, yy, zz, yz, xz, xy [Pa], tension
/// positive. Mohr-Coulomb in principal stresses: sigma_1/f_t - sigma_3/f_c = 1 at failure; the measure is f_t times the left
/// side, so that sigma* is a part of the tensile strength for all stress states.
double stress_measure(Criterion criterion, const Eigen::Matrix<double, 6, 1> &sigma, double tensile_strength,
                      double compressive_strength);
} // namespace kerf
