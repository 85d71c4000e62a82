// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/rock_bond_law.h"

#include <array>
#include <cstring>

namespace kerf::dem
{
/// Rotation of a particle, ready to turn vectors.
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
    const law::Vector<3, Real> across = Real(2.) * law::cross(imaginary, a);
    return a + real * across + law::cross(imaginary, across);
  }
};

/// All that the pair loops need of one particle side by side, in groups of four numbers that are read and written as a whole:
/// LIGGGHTS' separate arrays would cost a cache miss each, and bonds need the same numbers of several particles in lanes.
template <int dim>
struct ParticleRow;

template <>
struct alignas(64) ParticleRow<2>
{
  law::Vector<2> position;
  double radius, cosine;
  double sine;
  law::Spin<2> spin;
  law::Vector<2> velocity;
  law::Vector<2> force; ///< without the viscous part
  law::Spin<2> torque;
  double weight;
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
  double radius;
  double quaternion[4]; ///< (w, x, y, z)
  law::Spin<3> spin;
  double weight;
  law::Vector<3> velocity;
  double mass;
  law::Vector<3> force; ///< without the viscous part
  double padding_1;
  law::Spin<3> torque;
  double padding_2;
  law::Vector<3> damping_force;
  double padding_3;
  law::Spin<3> damping_torque;
  double padding_4;

  Turn<3> turn() const { return {quaternion[0], law::Vector<3>(quaternion[1], quaternion[2], quaternion[3])}; }
};
static_assert(sizeof(ParticleRow<3>) == 32 * sizeof(double));

/// Rows of the particles of several pairs.
using LaneRows = std::array<int, Lanes::size>;

/// One side of several pairs.
template <int dim>
struct RowLanes
{
  law::Vector<dim, Lanes> position, velocity;
  law::Spin<dim, Lanes> spin;
  Lanes radius;
  Turn<dim, Lanes> turn;
};

namespace detail
{
template <int dim>
[[gnu::always_inline]] inline Lanes load_group(const ParticleRow<dim> &row, int number)
{
  Lanes group;
  std::memcpy(&group.v, reinterpret_cast<const char *>(&row) + number * sizeof(Lanes), sizeof(Lanes));
  return group;
}
template <int dim>
[[gnu::always_inline]] inline void store_group(ParticleRow<dim> &row, int number, const Lanes &group)
{
  std::memcpy(reinterpret_cast<char *>(&row) + number * sizeof(Lanes), &group.v, sizeof(Lanes));
}
template <int dim>
[[gnu::always_inline]] inline std::array<Lanes, 4> gather_group(const ParticleRow<dim> *rows, const LaneRows &index, int number)
{
  std::array<Lanes, 4> columns;
  for (int lane = 0; lane < Lanes::size; ++lane)
    columns[lane] = load_group(rows[index[lane]], number);
  transpose(columns[0], columns[1], columns[2], columns[3]);
  return columns;
}
/// Several lanes may mean the same row.
template <int dim>
[[gnu::always_inline]] inline void add_group(ParticleRow<dim> *rows, const LaneRows &index, int number,
                                             std::array<Lanes, 4> columns)
{
  transpose(columns[0], columns[1], columns[2], columns[3]);
  for (int lane = 0; lane < Lanes::size; ++lane)
    store_group(rows[index[lane]], number, load_group(rows[index[lane]], number) + columns[lane]);
}
} // namespace detail

/// @tparam moving velocities are needed, too.
template <bool moving>
[[gnu::always_inline]] inline RowLanes<2> gather(const ParticleRow<2> *rows, const LaneRows &index)
{
  const auto a = detail::gather_group(rows, index, 0), b = detail::gather_group(rows, index, 1);
  return {{a[0], a[1]}, {b[2], b[3]}, law::Spin<2, Lanes>(b[1]), a[2], {a[3], b[0]}};
}
template <bool moving>
[[gnu::always_inline]] inline RowLanes<3> gather(const ParticleRow<3> *rows, const LaneRows &index)
{
  const auto a = detail::gather_group(rows, index, 0), q = detail::gather_group(rows, index, 1);
  RowLanes<3> lanes;
  lanes.position = {a[0], a[1], a[2]};
  lanes.radius = a[3];
  lanes.turn = {q[0], {q[1], q[2], q[3]}};
  if constexpr (moving)
  {
    const auto w = detail::gather_group(rows, index, 2), v = detail::gather_group(rows, index, 3);
    lanes.spin = {w[0], w[1], w[2]};
    lanes.velocity = {v[0], v[1], v[2]};
  }
  return lanes;
}

/// Adds loads to rows. @tparam viscous part, kept apart for the energy that it takes out.
template <bool viscous>
[[gnu::always_inline]] inline void scatter(ParticleRow<2> *rows, const LaneRows &index, const law::Vector<2, Lanes> &force,
                                           const law::Spin<2, Lanes> &torque)
{
  detail::add_group(rows, index, viscous ? 3 : 2, {force.x(), force.y(), torque[0], Lanes(0.)});
}
template <bool viscous>
[[gnu::always_inline]] inline void scatter(ParticleRow<3> *rows, const LaneRows &index, const law::Vector<3, Lanes> &force,
                                           const law::Spin<3, Lanes> &torque)
{
  detail::add_group(rows, index, viscous ? 6 : 4, {force.x(), force.y(), force.z(), Lanes(0.)});
  detail::add_group(rows, index, viscous ? 7 : 5, {torque.x(), torque.y(), torque.z(), Lanes(0.)});
}
} // namespace kerf::dem
