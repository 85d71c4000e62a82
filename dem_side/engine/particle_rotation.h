// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/particle_rows.h"

#include <cmath>
#include <cstring>

/// Rotations of four particles at a time, as quaternions (w, x, y, z) sorted by component.
namespace kerf::dem
{
/// Cosine and sin(a) / a of an angle given by its square.
struct Angle
{
  SimdPack cosine, sinc;
  explicit Angle(const SimdPack &square)
    : cosine(1. - square / 2. * (1. - square / 12. * (1. - square / 30.))), // remainders of the series below 1e-3: 1e-15
      sinc(1. - square / 6. * (1. - square / 20. * (1. - square / 42.)))
  {
    if (__builtin_expect(!any(square >= 1e-3), true))
      return;
    for (int lane = 0; lane < SimdPack::size; ++lane)
      if (square[lane] >= 1e-3)
      {
        const double angle = std::sqrt(square[lane]);
        cosine.set(lane, std::cos(angle));
        sinc.set(lane, std::sin(angle) / angle);
      }
  }
};

/// Rotates the unit quaternions q at the constant rate w over dt: q <- exp(w dt / 2) q.
template <int dim>
void rotate(SimdPack *q, const law::Spin<dim, SimdPack> &w, double dt)
{
  const law::Spin<dim, SimdPack> half = SimdPack(0.5 * dt) * w;
  const Angle angle(half.squaredNorm());
  const law::Spin<dim, SimdPack> axis = angle.sinc * half;
  // A Newton step prevents a drift of the norm by round-off.
  if constexpr (dim == 2)
  {
    const SimdPack real = angle.cosine * q[0] - axis[0] * q[3], z = angle.cosine * q[3] + axis[0] * q[0];
    const SimdPack unit = 1.5 - 0.5 * (real * real + z * z);
    q[0] = unit * real;
    q[3] = unit * z;
  }
  else
  {
    const law::Vector<3, SimdPack> now(q[1], q[2], q[3]);
    const SimdPack real = angle.cosine * q[0] - axis.dot(now);
    const law::Vector<3, SimdPack> next = angle.cosine * now + q[0] * axis + law::cross(axis, now);
    const SimdPack unit = 1.5 - 0.5 * (real * real + next.squaredNorm());
    q[0] = unit * real;
    for (int c = 0; c < 3; ++c)
      q[1 + c] = unit * next[c];
  }
}

/// Writes the rotations of @p n particles, given as quaternions sorted by component, to their rows. Changes @p q.
inline void set_rotation(ParticleRow<2> *rows, int n, SimdPack *q)
{
  const SimdPack cosine = q[0] * q[0] - q[3] * q[3], sine = 2. * q[0] * q[3];
  for (int lane = 0; lane < n; ++lane)
  {
    rows[lane].cosine = cosine[lane];
    rows[lane].sine = sine[lane];
  }
}
inline void set_rotation(ParticleRow<3> *rows, int n, SimdPack *q)
{
  transpose(q[0], q[1], q[2], q[3]);
  for (int lane = 0; lane < n; ++lane)
    std::memcpy(rows[lane].quaternion, &q[lane].v, sizeof(SimdPack));
}
} // namespace kerf::dem
