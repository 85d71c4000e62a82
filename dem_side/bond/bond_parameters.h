// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf::dem
{
/// Elastic-perfectly-brittle bond and the contact that remains after failure (Onate & Rojek 2004; Rojek et al. 2012). The shear
/// strength may depend on pressure, as in CIMNE's later law KDEM.
struct BondParameters
{
  double k_n = 0.;      ///< normal stiffness [N/m] (2D: per metre)
  double k_t = 0.;      ///< tangential stiffness, same unit
  double R_n = 0.;      ///< tensile strength [N] (2D: per metre)
  double R_t = 0.;      ///< shear strength, same unit
  double friction = 0.; ///< Coulomb coefficient after failure [-]
  double damping = 0.;  ///< fraction of critical damping of the contact, normal and tangential [-]
  /// Internal friction mu_b [-]: the intact bond under a compressive force F_c has the shear strength R_t + mu_b F_c. With 0
  /// the strength is that of Onate & Rojek 2004.
  double shear_friction = 0.;
  /// Bonds of less weight do not break, because they represent mostly elastic continuum [-].
  double breaking_weight = 0.;
};
} // namespace kerf::dem
