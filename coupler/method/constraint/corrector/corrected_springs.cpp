// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/corrector/corrected_springs.h"

#include <algorithm>
#include <type_traits>

namespace kerf
{
namespace
{
/// A field at eight particles. @p coefficient returns the coefficient of a monomial by its number.
template <std::size_t dim, typename Coefficient>
[[gnu::always_inline]] inline SimdPack value_at(const std::array<SimdPack, dim> &xi, const Coefficient &coefficient)
{
  double coefficients[1 << dim];
#pragma GCC unroll 8
  for (int m = 0; m < 1 << dim; ++m)
    coefficients[m] = coefficient(m);
  return value_of(coefficients, xi);
}

/// The sums of the rows, collected in a vector.
template <typename Vector, int n, typename Row>
[[gnu::always_inline]] inline Vector sums_of_rows(const Row &row)
{
  SimdPack rows[8] = {};
#pragma GCC unroll 8
  for (int k = 0; k < n; ++k)
    rows[k] = row(k);
  const SimdPack sums = sums_of(rows);
  if constexpr (std::is_same_v<Vector, SimdPack>)
    return sums;
  else if constexpr (std::is_same_v<Vector, SimdLanes>)
    return __builtin_shufflevector(sums, sums, 0, 1, 2, 3);
  else
    return __builtin_shufflevector(sums, sums, 0, 1);
}
} // namespace

template <int dim>
void CorrectedSprings<dim>::renew(const CellBatches<dim> &cells, const ParticleInterpolation &interpolation,
                                  const Corrector &corrector, const dem::Particles &particles,
                                  const std::vector<double> &stiffness)
{
  octets.clear();
  entry_of.clear();
  end.clear();
  std::size_t k = 0, longest = 0;
  for (const auto &cell : cells.cells())
  {
    std::vector<int> of_cell;
    for (; k < static_cast<std::size_t>(cell.end); ++k)
      for (int l = 0; l < n_simd_lanes; ++l)
        if (cells.is_used(k, l))
          of_cell.push_back(cells.entry(k, l));
    const std::size_t n = (of_cell.size() + n_octet - 1) / n_octet;
    for (std::size_t slot = 0; slot < n * n_octet; ++slot)
    {
      const int lane = lane_of<dim>(slot % n_octet), number = of_cell[std::min(slot, of_cell.size() - 1)];
      if (slot % n_octet == 0)
      {
        octets.emplace_back();
        entry_of.emplace_back();
      }
      Octet &octet = octets.back();
      entry_of.back()[slot % n_octet] = number;
      const InterpolatedParticle &entry = interpolation.entries()[number];
      for (int d = 0; d < dim; ++d)
        octet.xi[d][lane] = entry.xi[d];
      octet.stiffness[lane] = slot < of_cell.size() ? stiffness[number] : 0.;
      for (int c = 0; c < dim; ++c)
        for (int s = 0; s < n_strains; ++s)
          octet.fluctuation[c][s][lane] = static_cast<float>(corrector.of(particles.index[entry.particle], c, s));
    }
    end.push_back(static_cast<int>(octets.size()));
    longest = std::max(longest, n);
  }
  pulls.resize(longest);
  renumber(interpolation);
  strains.assign(corrector.gradient(), interpolation, cells);
}

template <int dim>
void CorrectedSprings<dim>::renumber(const ParticleInterpolation &interpolation)
{
  for (std::size_t k = 0; k < octets.size(); ++k)
    for (int slot = 0; slot < n_octet; ++slot)
      octets[k].begin[slot] = 3 * std::ptrdiff_t(interpolation.entries()[entry_of[k][slot]].particle);
}

template <int dim>
double CorrectedSprings<dim>::pull(const CellBatches<dim> &cells, const Eigen::Matrix3Xd &node_displacement,
                                   const Eigen::Vector3d &period, dem::Particles &particles, Eigen::Matrix3Xd &node_force)
{
  return period.isZero(0.) ? pull<false>(cells, node_displacement, period, particles, node_force)
                           : pull<true>(cells, node_displacement, period, particles, node_force);
}

template <int dim>
template <bool periodic>
double CorrectedSprings<dim>::pull(const CellBatches<dim> &cells, const Eigen::Matrix3Xd &node_displacement,
                                   const Eigen::Vector3d &period, dem::Particles &particles, Eigen::Matrix3Xd &node_force)
{
  strains.gather(node_displacement);
  SimdPack energy = {};
  int begin = 0;
  for (std::size_t n = 0; n < end.size(); ++n)
  {
    const auto &cell = cells.cells()[n];
    Field field;
    cells.places(cell, node_displacement, field.place);
    cells.coefficients_of(cell, strains.strain(), field.strain);
    for (int d = 0; d < dim; ++d)
      field.turn[d] = strains.turn(n, d);
    Sums sums{};
    // In three dimensions the sums exceed the registers, so they are computed one after the other.
    constexpr bool at_once = dim == 2;
    for (int k = begin; k < end[n]; ++k)
    {
      fetch_after(k, particles);
      const Pull pull = pull_octet<periodic>(octets[k], field, period, particles);
      energy += pull.energy;
      if constexpr (at_once)
      {
        for (int c = 0; c < dim; ++c)
          sums.add_force(octets[k], pull, c);
        for (int s = 0; s < n_strains; ++s)
          sums.add_stress(octets[k], pull, s);
      }
      else
        pulls[k - begin] = pull;
    }
    if constexpr (!at_once)
    {
      for (int c = 0; c < dim; ++c)
        for (int k = begin; k < end[n]; ++k)
          sums.add_force(octets[k], pulls[k - begin], c);
      for (int s = 0; s < n_strains; ++s)
        for (int k = begin; k < end[n]; ++k)
          sums.add_stress(octets[k], pulls[k - begin], s);
    }
    give(cells, n, sums, node_force);
    begin = end[n];
  }
  strains.scatter(node_force);
  return 0.5 * sum_of(energy);
}

/// Prefetches a later octet and the particle vectors of a closer one.
template <int dim>
[[gnu::always_inline]] inline void CorrectedSprings<dim>::fetch_after(int k, const dem::Particles &particles) const
{
  kerf::fetch_after(octets, k, 1, 6);
  fetch_vectors_after(octets, k, 3, particles.position, particles.force);
}

template <int dim>
template <bool periodic>
[[gnu::always_inline]] inline auto CorrectedSprings<dim>::pull_octet(const Octet &octet, const Field &field,
                                                                     const Eigen::Vector3d &period, dem::Particles &particles)
  -> Pull
{
  Pull pull{};
#pragma GCC unroll 8
  for (int s = 0; s < n_strains; ++s)
  {
    const SimdPack strain = value_at(octet.xi, [&](int m) { return field.strain[m][s]; });
#pragma GCC unroll 3
    for (int c = 0; c < dim; ++c)
      pull.fluctuation[c] += widened(octet.fluctuation[c][s]) * strain;
  }
  const auto position = load_octet<dim>(particles.position.data(), octet.begin);
  SimdPack turned_back[dim] = {};
#pragma GCC unroll 3
  for (int c = 0; c < dim; ++c)
  {
    SimdPack gap = value_at(octet.xi, [&](int m) { return field.place[m][c]; }) - position[c]; // -chi
#pragma GCC unroll 3
    for (int d = 0; d < dim; ++d)
      gap += field.turn[d][c] * pull.fluctuation[d];
    if (periodic && period[c] > 0.)
      wrap(gap, period[c]);
    pull.force[c] = octet.stiffness * gap;
    pull.energy += pull.force[c] * gap;
#pragma GCC unroll 3
    for (int d = 0; d < dim; ++d)
      turned_back[d] += field.turn[d][c] * pull.force[c];
  }
  add_octet<dim>(particles.force.data(), octet.begin, pull.force);
#pragma GCC unroll 8
  for (int s = 0; s < n_strains; ++s)
#pragma GCC unroll 3
    for (int c = 0; c < dim; ++c)
      pull.stress[s] += widened(octet.fluctuation[c][s]) * turned_back[c];
  return pull;
}

template <int dim>
[[gnu::always_inline]] inline void CorrectedSprings<dim>::Sums::add_force(const Octet &octet, const Pull &pull, int c)
{
  add_moments(pull.force[c], octet.xi, force[c]);
#pragma GCC unroll 3
  for (int d = 0; d < dim; ++d)
    turn[d][c] += pull.force[c] * pull.fluctuation[d];
}

template <int dim>
[[gnu::always_inline]] inline void CorrectedSprings<dim>::Sums::add_stress(const Octet &octet, const Pull &pull, int s)
{
  add_moments(pull.stress[s], octet.xi, stress[s]);
}

/// Adds the nodal forces of the springs of a cell and their values conjugate to the strains and to F. Theory (6.8).
template <int dim>
[[gnu::always_inline]] inline void CorrectedSprings<dim>::give(const CellBatches<dim> &cells, std::size_t cell,
                                                               const Sums &sums, Eigen::Matrix3Xd &node_force)
{
  using One = typename PackedVectors<dim>::One;
  using Strain = typename StrainComponents<dim>::Vector;
  One force[corners];
  Strain stress[corners];
#pragma GCC unroll 8
  for (int m = 0; m < corners; ++m)
  {
    force[m] = -sums_of_rows<One, dim>([&](int c) { return sums.force[c][m]; });
    stress[m] = -sums_of_rows<Strain, n_strains>([&](int s) { return sums.stress[s][m]; });
  }
  cells.scatter(cells.cells()[cell], force, node_force);
  cells.scatter_to(cells.cells()[cell], stress, strains.given());
#pragma GCC unroll 3
  for (int d = 0; d < dim; ++d)
    strains.give_to_turn(cell, d, -sums_of_rows<One, dim>([&](int c) { return sums.turn[d][c]; }));
}

template class CorrectedSprings<2>;
template class CorrectedSprings<3>;
} // namespace kerf
