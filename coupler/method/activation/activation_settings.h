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

/// When cells become particles and finite elements again.
struct ActivationSettings
{
  Criterion criterion = Criterion::mohr_coulomb;
  double tensile_strength = 0.;     ///< f_t of the rock [Pa]
  double compressive_strength = 0.; ///< f_c of the rock [Pa]
  double sigma_star = 0.;           ///< [Pa]
  int check_interval = 0;           ///< steps
  int relaxation_steps = 0;         ///< of new particles before time goes on
  double event_fraction = 1.;       ///< of sigma*: an event also takes cells of the front whose stress is above this
  double return_fraction = 0.;      ///< of sigma*: cells of particles below this become finite elements again; 0: never
  double return_time = 0.;          ///< for which they must have been below it [s]
};
} // namespace kerf
