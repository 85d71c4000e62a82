// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/activation/activation_settings.h"

#include <Eigen/Core>

namespace kerf
{
/// Stress measure [Pa] that is compared with sigma* (Labra et al., eq. (5)), from a Cauchy stress xx, yy, zz, yz, xz, xy [Pa],
/// tension positive. Mohr-Coulomb in principal stresses: sigma_1/f_t - sigma_3/f_c = 1 at failure; the measure is f_t times the
/// left side, so that sigma* is a part of the tensile strength for all stress states. Drucker-Prager likewise: sqrt(J_2) + a
/// I_1 = k at failure with a = (f_c - f_t)/(sqrt(3) (f_c + f_t)) and k = 2 f_c f_t/(sqrt(3) (f_c + f_t)), the cone through both
/// uniaxial strengths (Drucker & Prager 1952); the measure is f_t/k times the left side. Theory (7.4), (7.5).
double stress_measure(Criterion criterion, const Eigen::Matrix<double, 6, 1> &sigma, double tensile_strength,
                      double compressive_strength);

/// A stress with this Frobenius norm or less is below the measure by any criterion [Pa].
double norm_below(double measure, double tensile_strength, double compressive_strength);
} // namespace kerf
