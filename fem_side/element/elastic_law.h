// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf::fem
{
/// Stress from the displacement gradient H = du/dX for one number or a SIMD pack of numbers. In two dimensions plane strain:
/// the out-of-plane strain is zero, so in-plane stresses follow from in-plane strains alone.

/// Green's strain and the second Piola-Kirchhoff stress, work conjugate to it (Holzapfel 2000, sec. 2.5, 3.4).
struct FiniteStrain
{
  static constexpr bool linear = false;

  /// E = (H + H^T + H^T H)/2. Theory (2.1).
  template <int dim, typename Number>
  static void strain(const Number (&H)[dim][dim], Number (&E)[dim][dim])
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
  /// tr E without the other components.
  template <int dim, typename Number>
  static Number dilatation(const Number (&H)[dim][dim])
  {
    Number squares = H[0][0] * H[0][0];
    Number trace = H[0][0];
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        if (i + j > 0)
        {
          squares += H[i][j] * H[i][j];
          if (i == j)
            trace += H[i][i];
        }
    return trace + 0.5 * squares;
  }
  /// First Piola-Kirchhoff stress P = F S, work conjugate to F = 1 + H.
  template <int dim, typename Number>
  static void piola_of(const Number (&H)[dim][dim], const Number (&S)[dim][dim], Number (&P)[dim][dim])
  {
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
      {
        P[i][j] = S[i][j];
        for (int k = 0; k < dim; ++k)
          P[i][j] += H[i][k] * S[k][j];
      }
  }
  /// F^T q: a vector q of the current configuration seen from the reference configuration.
  template <int dim, typename Number>
  static void pull_back(const Number (&H)[dim][dim], const Number (&q)[dim], Number (&p)[dim])
  {
    for (int j = 0; j < dim; ++j)
    {
      p[j] = q[j];
      for (int i = 0; i < dim; ++i)
        p[j] += H[i][j] * q[i];
    }
  }
  /// F p, the transpose of pull_back().
  template <int dim, typename Number>
  static void push_forward(const Number (&H)[dim][dim], const Number (&p)[dim], Number (&q)[dim])
  {
    for (int i = 0; i < dim; ++i)
    {
      q[i] = p[i];
      for (int j = 0; j < dim; ++j)
        q[i] += H[i][j] * p[j];
    }
  }
};

/// The limit of small displacements and rotations, in which all measures of stress are equal.
struct SmallStrain
{
  static constexpr bool linear = true;

  /// (H + H^T)/2.
  template <int dim, typename Number>
  static void strain(const Number (&H)[dim][dim], Number (&E)[dim][dim])
  {
    for (int i = 0; i < dim; ++i)
    {
      E[i][i] = H[i][i];
      for (int j = i + 1; j < dim; ++j)
        E[i][j] = E[j][i] = 0.5 * (H[i][j] + H[j][i]);
    }
  }
  template <int dim, typename Number>
  static Number dilatation(const Number (&H)[dim][dim])
  {
    Number trace = H[0][0];
    for (int i = 1; i < dim; ++i)
      trace += H[i][i];
    return trace;
  }
  template <int dim, typename Number>
  static void piola_of(const Number (&)[dim][dim], const Number (&S)[dim][dim], Number (&P)[dim][dim])
  {
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        P[i][j] = S[i][j];
  }
  template <int dim, typename Number>
  static void pull_back(const Number (&)[dim][dim], const Number (&q)[dim], Number (&p)[dim])
  {
    for (int i = 0; i < dim; ++i)
      p[i] = q[i];
  }
  template <int dim, typename Number>
  static void push_forward(const Number (&)[dim][dim], const Number (&p)[dim], Number (&q)[dim])
  {
    for (int i = 0; i < dim; ++i)
      q[i] = p[i];
  }
};

/// Isotropic elasticity, linear between the stress and the strain of @p Measure.
template <typename Measure>
struct ElasticLaw : Measure
{
  double lambda = 0.; ///< Lame [Pa]
  double mu = 0.;     ///< Lame [Pa]

  ElasticLaw(const double lambda, const double mu) : lambda(lambda), mu(mu) {}

  double bulk_modulus() const { return lambda + 2. / 3. * mu; }
  double young() const { return mu * (3. * lambda + 2. * mu) / (lambda + mu); }
  /// Lambda of plane stress: with it and mu the in-plane law of a sheet without normal stress.
  double sheet_lambda() const { return 2. * lambda * mu / (lambda + 2. * mu); }

  template <int dim, typename Number>
  static Number trace(const Number (&E)[dim][dim])
  {
    Number sum = E[0][0];
    for (int i = 1; i < dim; ++i)
      sum += E[i][i];
    return sum;
  }
  template <int dim, typename Number>
  static Number squares(const Number (&E)[dim][dim])
  {
    Number diagonal = E[0][0] * E[0][0], sum = 0. * diagonal;
    for (int i = 1; i < dim; ++i)
    {
      diagonal += E[i][i] * E[i][i];
      for (int j = 0; j < i; ++j)
        sum += E[i][j] * E[i][j];
    }
    return diagonal + 2. * sum;
  }

  /// Second Piola-Kirchhoff stress lambda tr(E) 1 + 2 mu E [Pa]; returns its out-of-plane component of plane strain.
  template <int dim, typename Number>
  Number second_piola(const Number (&E)[dim][dim], Number (&S)[dim][dim]) const
  {
    const Number pressure = lambda * trace<dim>(E);
    second_piola<dim>(E, pressure, S);
    return pressure;
  }
  /// The same with a mean of the dilatation over the cell (B-bar, Hughes 1980): the deviator of E keeps its stress. Theory
  /// (2.5).
  template <int dim, typename Number>
  Number second_piola_of_mean(const Number (&E)[dim][dim], const Number &mean_dilatation, Number (&S)[dim][dim]) const
  {
    const Number pressure = bulk_modulus() * mean_dilatation - (2. / 3. * mu) * trace<dim>(E);
    second_piola<dim>(E, pressure, S);
    return pressure;
  }
  template <int dim, typename Number>
  void second_piola(const Number (&E)[dim][dim], const Number &pressure, Number (&S)[dim][dim]) const
  {
    for (int i = 0; i < dim; ++i)
    {
      S[i][i] = (2. * mu) * E[i][i] + pressure;
      for (int j = 0; j < i; ++j)
        S[i][j] = S[j][i] = (2. * mu) * E[i][j];
    }
  }

  /// First Piola-Kirchhoff stress [Pa].
  template <int dim, typename Number>
  void first_piola(const Number (&H)[dim][dim], Number (&P)[dim][dim]) const
  {
    Number E[dim][dim], S[dim][dim];
    Measure::template strain<dim>(H, E);
    second_piola<dim>(E, S);
    Measure::template piola_of<dim>(H, S, P);
  }

  /// Stored energy lambda/2 tr(E)^2 + mu E:E [J/m^3].
  template <int dim, typename Number>
  Number energy_density(const Number (&H)[dim][dim]) const
  {
    Number E[dim][dim];
    Measure::template strain<dim>(H, E);
    const Number dilatation = trace<dim>(E);
    return (0.5 * lambda) * dilatation * dilatation + mu * squares<dim>(E);
  }
  /// The part of the deviator, mu dev(E):dev(E) [J/m^3].
  template <int dim, typename Number>
  Number deviatoric_energy_density(const Number (&H)[dim][dim]) const
  {
    Number E[dim][dim];
    Measure::template strain<dim>(H, E);
    const Number dilatation = trace<dim>(E);
    return mu * (squares<dim>(E) - (1. / 3.) * dilatation * dilatation);
  }
};

/// S = lambda tr(E) 1 + 2 mu E with Green's strain (Holzapfel 2000, sec. 6.5).
using StVenantKirchhoff = ElasticLaw<FiniteStrain>;
/// The same material linearised at the undeformed state (Hooke).
using LinearisedLaw = ElasticLaw<SmallStrain>;
} // namespace kerf::fem
