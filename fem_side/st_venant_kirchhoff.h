// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf::fem
{
/// Stress from the displacement gradient H = du/dX for one number or a SIMD pack of numbers. In two dimensions plane strain:
/// the out-of-plane strain is zero, so in-plane stresses follow from in-plane strains alone.

/// St. Venant-Kirchhoff: S = lambda tr(E) 1 + 2 mu E with Green's strain E = (H + H^T + H^T H)/2 (Holzapfel 2000, sec. 6.5).
struct StVenantKirchhoff
{
  double lambda = 0.; ///< Lame [Pa]
  double mu = 0.;     ///< Lame [Pa]

  template <int dim, typename Number>
  static void green_strain(const Number (&H)[dim][dim], Number (&E)[dim][dim])
  {
    for (int i = 0; i < dim; ++i)
      for (int j = i; j < dim; ++j)
      {
        Number e = H[i][j] + H[j][i];
        for (int k = 0; k < dim; ++k)
          e += H[k][i] * H[k][j];
        E[i][j] = E[j][i] = 0.5 * e;
      }
  }

  /// Second Piola-Kirchhoff stress [Pa]; returns its out-of-plane component S_zz of plane strain.
  template <int dim, typename Number>
  Number second_piola(const Number (&E)[dim][dim], Number (&S)[dim][dim]) const
  {
    Number pressure = E[0][0];
    for (int i = 1; i < dim; ++i)
      pressure += E[i][i];
    pressure *= lambda;
    for (int i = 0; i < dim; ++i)
    {
      for (int j = 0; j < dim; ++j)
        S[i][j] = (2. * mu) * E[i][j];
      S[i][i] += pressure;
    }
    return pressure;
  }

  /// First Piola-Kirchhoff stress P = F S [Pa], work conjugate to F = 1 + H.
  template <int dim, typename Number>
  void first_piola(const Number (&H)[dim][dim], Number (&P)[dim][dim]) const
  {
    Number E[dim][dim], S[dim][dim];
    green_strain<dim>(H, E);
    second_piola<dim>(E, S);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
      {
        P[i][j] = S[i][j];
        for (int k = 0; k < dim; ++k)
          P[i][j] += H[i][k] * S[k][j];
      }
  }

  /// Stored energy W = lambda/2 tr(E)^2 + mu E:E [J/m^3].
  template <int dim, typename Number>
  Number energy_density(const Number (&H)[dim][dim]) const
  {
    Number E[dim][dim];
    green_strain<dim>(H, E);
    Number trace = E[0][0];
    Number squares = E[0][0] * E[0][0];
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        if (i + j > 0)
        {
          squares += E[i][j] * E[i][j];
          if (i == j)
            trace += E[i][i];
        }
    return (0.5 * lambda) * trace * trace + mu * squares;
  }
};

/// The same material linearised at the undeformed state (Hooke): P = lambda tr(H) 1 + mu (H + H^T).
struct LinearisedLaw
{
  double lambda = 0.; ///< Lame [Pa]
  double mu = 0.;     ///< Lame [Pa]

  template <int dim, typename Number>
  void first_piola(const Number (&H)[dim][dim], Number (&P)[dim][dim]) const
  {
    Number pressure = H[0][0];
    for (int i = 1; i < dim; ++i)
      pressure += H[i][i];
    pressure *= lambda;
    for (int i = 0; i < dim; ++i)
    {
      for (int j = 0; j < dim; ++j)
        P[i][j] = mu * (H[i][j] + H[j][i]);
      P[i][i] += pressure;
    }
  }
};
} // namespace kerf::fem
