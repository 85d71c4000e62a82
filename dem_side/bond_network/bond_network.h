// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond_network/moduli.h"
#include "dem_side/bond_network/network_operator.h"
#include "dem_side/packing/packing.h"

#include <functional>

namespace kerf::dem
{
/// Moduli by a static solve of the bond network (2D: sparse Cholesky, 3D: conjugate gradients). The outer skin of the sample
/// follows a uniform strain and the inside relaxes. Stress (bond virial over Laguerre cells) and strain (least-squares
/// displacement gradient) are measured well inside. Throws std::invalid_argument when the packing is too small.
/// @p k_n, @p k_t stiffnesses of a bond [N/m] (2D: per metre)
/// @param sample_size at most about this many particles from the middle of the packing are used.
Moduli relaxed_moduli(const Packing &packing, double k_n, double k_t, int sample_size = 20000);

/// Moduli of the affine (not relaxed) network, for comparison.
Moduli affine_moduli(const Packing &packing, double k_n, double k_t);

/// Finds k_n and k_t for which the relaxed moduli are @p young [Pa] and @p poisson. k_n scales Young's modulus; a secant
/// iteration on k_t / k_n finds Poisson's ratio. Throws std::invalid_argument when @p poisson is out of reach for
/// 0 <= k_t / k_n <= 2, with the reachable range.
ElasticCalibration calibrate_elastic(const Packing &packing, double young, double poisson);

/// Largest angular frequency [rad/s] of the free network with translations and rotations: a safe upper estimate by Lanczos
/// iteration on M^-1 K. Theory (8.6). @param density of the particles [kg/m^3], see Packing::particle_density().
double largest_frequency(const Packing &packing, double k_n, double k_t, double density);

/// Largest step of the free network with its dashpots, whose forces use the velocity of half a step before, for which
/// lambda_max(M^-1 (dt^2 K + 2 dt C)) <= @p limit: a safe lower estimate [s], infinite without bonds. Theory (8.1), (8.6).
/// @param dashpots against the translations of each particle, in addition to those of the bonds [N s/m]; empty: none
/// @param limit 4, or what other forces leave of it at a step; it must not grow with the step. Not positive: the step is 0
double largest_step(const Packing &packing, const NetworkOperator::Material &material, const Eigen::VectorXd &dashpots,
                    const std::function<double(double dt)> &limit);
} // namespace kerf::dem
