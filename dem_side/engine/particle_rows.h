// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond/rock_bond_law.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <stdexcept>

namespace kerf::dem
{
/// Rotation of a particle in the form that rotates vectors.
template <int dim, typename Real = double>
struct Turn;

template <typename Real>
struct Turn<2, Real>
{
  Real cosine, sine;
  law::Vector<2, Real> operator*(const law::Vector<2, Real> &a) const { return cosine * a + sine * law::quarter_turn(a); }
};

template <typename Real>
struct Turn<3, Real>
{
  Real real;
  law::Vector<3, Real> imaginary;
  law::Vector<3, Real> operator*(const law::Vector<3, Real> &a) const
  {
    const law::Vector<3, Real> across = law::cross(imaginary, a);
    return a + Real(2.) * (real * across + law::cross(imaginary, across));
  }
};

/// All data of one particle that the pair loops need, in groups of four numbers that are read and written as a whole. Each of
/// LIGGGHTS' separate arrays would cost a cache miss. The groups of several particles are transposed into SIMD packs.
template <int dim>
struct ParticleRow;

template <>
struct alignas(64) ParticleRow<2>
{
  law::Vector<2> position;
  double weighted_radius, cosine;
  double sine;
  law::Spin<2> spin;
  law::Vector<2> velocity;
  law::Vector<2> force; ///< without the viscous part
  law::Spin<2> torque;
  double radius;
  law::Vector<2> damping_force;
  law::Spin<2> damping_torque;
  double mass;

  Turn<2> turn() const { return {cosine, sine}; }
};
static_assert(sizeof(ParticleRow<2>) == 16 * sizeof(double));

template <>
struct alignas(64) ParticleRow<3>
{
  law::Vector<3> position;
  double weighted_radius;
  double quaternion[4]; ///< (w, x, y, z)
  law::Spin<3> spin;
  double radius;
  law::Vector<3> velocity;
  double mass;
  law::Vector<3> force; ///< without the viscous part
  law::Spin<3> torque;
  law::Vector<3> damping_force;
  law::Spin<3> damping_torque;

  Turn<3> turn() const { return {quaternion[0], law::Vector<3>(quaternion[1], quaternion[2], quaternion[3])}; }
};
static_assert(offsetof(ParticleRow<3>, force) == 16 * sizeof(double) && sizeof(ParticleRow<3>) == 32 * sizeof(double));

/// Rows of the particles of several pairs, as offsets in bytes, which saves multiplications at each access.
struct PackRows
{
  std::array<std::uint32_t, SimdPack::size> offsets;

  template <typename Row>
  void set(int lane, int row)
  {
    if (std::size_t(row) * sizeof(Row) > std::numeric_limits<std::uint32_t>::max())
      throw std::invalid_argument("more particles on one rank than the bond loop can count: use more ranks");
    offsets[lane] = static_cast<std::uint32_t>(row * sizeof(Row));
  }
};

/// The particles on one side of several pairs.
template <int dim>
struct GatheredRows
{
  law::Vector<dim, SimdPack> position, velocity;
  law::Spin<dim, SimdPack> spin;
  SimdPack weighted_radius;
  Turn<dim, SimdPack> turn;
};

namespace detail
{
template <int dim>
[[gnu::always_inline]] inline SimdPack load_group(const ParticleRow<dim> *rows, std::uint32_t offset, int number)
{
  SimdPack group;
  std::memcpy(&group.v, reinterpret_cast<const char *>(rows) + offset + number * sizeof(SimdPack), sizeof(SimdPack));
  return group;
}
template <int dim>
[[gnu::always_inline]] inline void store_group(ParticleRow<dim> *rows, std::uint32_t offset, int number, const SimdPack &group)
{
  std::memcpy(reinterpret_cast<char *>(rows) + offset + number * sizeof(SimdPack), &group.v, sizeof(SimdPack));
}
template <int dim>
[[gnu::always_inline]] inline std::array<SimdPack, 4> gather_group(const ParticleRow<dim> *rows, const PackRows &index,
                                                                   int number)
{
  std::array<SimdPack, 4> columns;
  for (int lane = 0; lane < SimdPack::size; ++lane)
    columns[lane] = load_group(rows, index.offsets[lane], number);
  transpose(columns[0], columns[1], columns[2], columns[3]);
  return columns;
}
/// Several lanes may refer to the same row.
template <int dim>
[[gnu::always_inline]] inline void add_group(ParticleRow<dim> *rows, const PackRows &index, int number,
                                             std::array<SimdPack, 4> columns)
{
  transpose(columns[0], columns[1], columns[2], columns[3]);
  for (int lane = 0; lane < SimdPack::size; ++lane)
    store_group(rows, index.offsets[lane], number, load_group(rows, index.offsets[lane], number) + columns[lane]);
}
} // namespace detail

/// @tparam moving whether velocities are needed.
template <bool moving>
[[gnu::always_inline]] inline GatheredRows<2> gather(const ParticleRow<2> *rows, const PackRows &index)
{
  const auto a = detail::gather_group(rows, index, 0), b = detail::gather_group(rows, index, 1);
  return {{a[0], a[1]}, {b[2], b[3]}, law::Spin<2, SimdPack>(b[1]), a[2], {a[3], b[0]}};
}
template <bool moving>
[[gnu::always_inline]] inline GatheredRows<3> gather(const ParticleRow<3> *rows, const PackRows &index)
{
  const auto a = detail::gather_group(rows, index, 0), q = detail::gather_group(rows, index, 1);
  GatheredRows<3> lanes;
  lanes.position = {a[0], a[1], a[2]};
  lanes.weighted_radius = a[3];
  lanes.turn = {q[0], {q[1], q[2], q[3]}};
  if constexpr (moving)
  {
    const auto w = detail::gather_group(rows, index, 2), v = detail::gather_group(rows, index, 3);
    lanes.spin = {w[0], w[1], w[2]};
    lanes.velocity = {v[0], v[1], v[2]};
  }
  return lanes;
}

/// Loads rows into the cache before they are needed. @tparam moving as for gather(); without velocities only every other cache
/// line is read.
template <bool moving>
[[gnu::always_inline]] inline void prefetch(const ParticleRow<3> *rows, const PackRows &index)
{
  constexpr std::size_t cache_line = 64;
  for (const std::uint32_t offset : index.offsets)
    for (std::size_t part = 0; part < sizeof(ParticleRow<3>); part += (moving ? 1 : 2) * cache_line)
      __builtin_prefetch(reinterpret_cast<const char *>(rows) + offset + part, 1);
}

/// Load on one particle of each pair. Elastic and viscous parts are separate, because the dissipated energy is counted.
template <int dim>
struct PackLoad
{
  law::Vector<dim, SimdPack> force;
  law::Spin<dim, SimdPack> torque;
};

[[gnu::always_inline]] inline void add(ParticleRow<2> *rows, const PackRows &index, const PackLoad<2> &elastic)
{
  detail::add_group(rows, index, 2, {elastic.force.x(), elastic.force.y(), elastic.torque[0], SimdPack(0.)});
}
[[gnu::always_inline]] inline void add(ParticleRow<2> *rows, const PackRows &index, const PackLoad<2> &elastic,
                                       const PackLoad<2> &viscous)
{
  add(rows, index, elastic);
  detail::add_group(rows, index, 3, {viscous.force.x(), viscous.force.y(), viscous.torque[0], SimdPack(0.)});
}
[[gnu::always_inline]] inline void add(ParticleRow<3> *rows, const PackRows &index, const PackLoad<3> &elastic)
{
  const auto &[force, torque] = elastic;
  detail::add_group(rows, index, 4, {force.x(), force.y(), force.z(), torque.x()});
  detail::add_group(rows, index, 5, {torque.y(), torque.z(), SimdPack(0.), SimdPack(0.)});
}
[[gnu::always_inline]] inline void add(ParticleRow<3> *rows, const PackRows &index, const PackLoad<3> &elastic,
                                       const PackLoad<3> &viscous)
{
  const auto &[force, torque] = elastic;
  detail::add_group(rows, index, 4, {force.x(), force.y(), force.z(), torque.x()});
  detail::add_group(rows, index, 5, {torque.y(), torque.z(), viscous.force.x(), viscous.force.y()});
  detail::add_group(rows, index, 6, {viscous.force.z(), viscous.torque.x(), viscous.torque.y(), viscous.torque.z()});
}
} // namespace kerf::dem
