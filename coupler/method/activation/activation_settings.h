// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf
{
enum class Criterion
{
  maximum_principal, ///< largest principal stress
  von_mises,
  mohr_coulomb,  ///< sigma_1 - sigma_3 f_t/f_c, equal to the tensile strength on the failure line
  drucker_prager ///< the cone through f_t and f_c, equal to the tensile strength on it
};

/// When cells become particles and when they return to the continuum.
struct ActivationSettings
{
  Criterion criterion = Criterion::mohr_coulomb;
  double tensile_strength = 0.;     ///< f_t of the rock [Pa]
  double compressive_strength = 0.; ///< f_c of the rock [Pa]
  double sigma_star = 0.;           ///< [Pa]
  bool by_contact = true;           ///< cells that cannot resolve a contact are converted before it begins
  int check_interval = 0;           ///< steps between two checks
  int relaxation_steps = 0;         ///< iterations of the relaxation of new particles, at constant time
  double event_fraction = 1.;       ///< fraction of sigma* above which an event also converts cells next to the particle region
  double return_fraction = 0.;      ///< fraction of sigma* below which particle cells return to the continuum; 0: never
  double return_time = 0.;          ///< time for which their stress must have been below it [s]
};
} // namespace kerf
