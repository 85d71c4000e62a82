// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/activation/activation_settings.h"

#include <Eigen/Core>

namespace kerf
{
/// Stress measure [Pa] that ActivationRule::cells_to_convert() compares with sigma* (Labra et al., eq. (5)). @p sigma is the
/// Cauchy stress xx, yy, zz, yz, xz, xy [Pa], tension positive. Mohr-Coulomb fails at sigma_1/f_t - sigma_3/f_c = 1 in
/// principal stresses. The measure is f_t times the left side, so sigma* is a fraction of the tensile strength in every stress
/// state. Drucker-Prager (1952) fails at sqrt(J_2) + a I_1 = k with a = (f_c - f_t)/(sqrt(3) (f_c + f_t)) and k = 2 f_c
/// f_t/(sqrt(3) (f_c + f_t)), the cone through both uniaxial strengths. The measure is f_t/k times the left side. Theory (7.4),
/// (7.5).
double stress_measure(Criterion criterion, const Eigen::Matrix<double, 6, 1> &sigma, double tensile_strength,
                      double compressive_strength);

/// Lower bound of the Frobenius norm of a stress that reaches @p measure by any criterion [Pa].
double norm_below(double measure, double tensile_strength, double compressive_strength);
} // namespace kerf
