// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

// Without AVX the compiler notes that it hands the vectors on in memory; nothing outside of the program sees them.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace kerf::dem
{
/// Four numbers that go through the same arithmetic, as a scalar of Eigen's small vectors. Four whatever the machine: narrower
/// vector units take two instructions, and results do not depend on the width.
struct alignas(32) Lanes
{
  static constexpr int size = 4;
  typedef double Vector __attribute__((vector_size(32)));
  typedef long long Mask __attribute__((vector_size(32)));

  Vector v;

  Lanes() = default;
  Lanes(double a) : v{a, a, a, a} {} // implicit: constants mix with lanes
  Lanes(const Vector &v) : v(v) {}
  // A copy of the whole, else the compiler copies in pieces through memory.
  Lanes(const Lanes &a) : v(a.v) {}
  Lanes &operator=(const Lanes &a) { return v = a.v, *this; }

  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double a) { v[lane] = a; }
  Lanes &operator+=(const Lanes &b) { return v += b.v, *this; }
  Lanes &operator-=(const Lanes &b) { return v -= b.v, *this; }
  Lanes &operator*=(const Lanes &b) { return v *= b.v, *this; }
  Lanes operator-() const { return Vector(-v); }

  friend Lanes operator+(const Lanes &a, const Lanes &b) { return Vector(a.v + b.v); }
  friend Lanes operator-(const Lanes &a, const Lanes &b) { return Vector(a.v - b.v); }
  friend Lanes operator*(const Lanes &a, const Lanes &b) { return Vector(a.v * b.v); }
  friend Lanes operator/(const Lanes &a, const Lanes &b) { return Vector(a.v / b.v); }
  friend Mask operator>=(const Lanes &a, const Lanes &b) { return a.v >= b.v; }
  friend Mask operator<(const Lanes &a, const Lanes &b) { return a.v < b.v; }
  friend Lanes min(const Lanes &a, const Lanes &b) { return Vector(a.v < b.v ? a.v : b.v); }
  friend Lanes sqrt(const Lanes &a)
  {
    Lanes root;
    for (int lane = 0; lane < size; ++lane)
      root.v[lane] = std::sqrt(a.v[lane]);
    return root;
  }
};

inline bool any(const Lanes::Mask &mask)
{
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
}

/// Rows of four numbers to columns or back.
inline void transpose(Lanes &a, Lanes &b, Lanes &c, Lanes &d)
{
  const Lanes::Vector even_ab = __builtin_shufflevector(a.v, b.v, 0, 4, 2, 6),
                      odd_ab = __builtin_shufflevector(a.v, b.v, 1, 5, 3, 7);
  const Lanes::Vector even_cd = __builtin_shufflevector(c.v, d.v, 0, 4, 2, 6),
                      odd_cd = __builtin_shufflevector(c.v, d.v, 1, 5, 3, 7);
  a.v = __builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5);
  b.v = __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5);
  c.v = __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7);
  d.v = __builtin_shufflevector(odd_ab, odd_cd, 2, 3, 6, 7);
}
} // namespace kerf::dem

template <>
struct Eigen::NumTraits<kerf::dem::Lanes> : Eigen::GenericNumTraits<kerf::dem::Lanes>
{
  enum
  {
    IsComplex = 0,
    IsInteger = 0,
    IsSigned = 1,
    RequireInitialization = 0,
    ReadCost = 1,
    AddCost = 1,
    MulCost = 1
  };
};
