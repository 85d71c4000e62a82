// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstring>
#ifdef __AVX__
#include <immintrin.h>
#endif

// Without AVX the compiler warns that it passes the vectors in memory. No interface outside of the program has them.
#pragma GCC diagnostic ignored "-Wpsabi"

namespace kerf::dem
{
/// Four numbers that go through the same arithmetic, usable as the scalar of Eigen's small vectors. Four on every machine: a
/// narrower vector unit takes two instructions, and the results do not depend on its width.
struct alignas(32) SimdPack
{
  static constexpr int size = 4;
  typedef double Vector __attribute__((vector_size(32)));
  typedef long long Mask __attribute__((vector_size(32)));

  Vector v;

  SimdPack() = default;
  SimdPack(double a) : v{a, a, a, a} {} // implicit: constants mix with packs
  SimdPack(const Vector &v) : v(v) {}
  // Copies the whole vector; the compiler's own copy goes through memory in pieces.
  SimdPack(const SimdPack &a) : v(a.v) {}
  SimdPack &operator=(const SimdPack &a) { return v = a.v, *this; }

  double operator[](int lane) const { return v[lane]; }
  void set(int lane, double a) { v[lane] = a; }
  SimdPack &operator+=(const SimdPack &b) { return v += b.v, *this; }
  SimdPack &operator-=(const SimdPack &b) { return v -= b.v, *this; }
  SimdPack &operator*=(const SimdPack &b) { return v *= b.v, *this; }
  SimdPack operator-() const { return Vector(-v); }

  friend SimdPack operator+(const SimdPack &a, const SimdPack &b) { return Vector(a.v + b.v); }
  friend SimdPack operator-(const SimdPack &a, const SimdPack &b) { return Vector(a.v - b.v); }
  friend SimdPack operator*(const SimdPack &a, const SimdPack &b) { return Vector(a.v * b.v); }
  friend SimdPack operator/(const SimdPack &a, const SimdPack &b) { return Vector(a.v / b.v); }
  friend Mask operator>=(const SimdPack &a, const SimdPack &b) { return a.v >= b.v; }
  friend Mask operator<(const SimdPack &a, const SimdPack &b) { return a.v < b.v; }
  friend SimdPack min(const SimdPack &a, const SimdPack &b) { return Vector(a.v < b.v ? a.v : b.v); }
  friend SimdPack sqrt(const SimdPack &a)
  {
    SimdPack root;
    for (int lane = 0; lane < size; ++lane)
      root.v[lane] = std::sqrt(a.v[lane]);
    return root;
  }
};

inline bool any(const SimdPack::Mask &mask)
{
#ifdef __AVX__
  return _mm256_movemask_pd(SimdPack::Vector(mask)) != 0; // saves half a dozen instructions
#else
  return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}

/// Transposes four rows of four numbers.
inline void transpose(SimdPack &a, SimdPack &b, SimdPack &c, SimdPack &d)
{
  const SimdPack::Vector even_ab = __builtin_shufflevector(a.v, b.v, 0, 4, 2, 6),
                         odd_ab = __builtin_shufflevector(a.v, b.v, 1, 5, 3, 7);
  const SimdPack::Vector even_cd = __builtin_shufflevector(c.v, d.v, 0, 4, 2, 6),
                         odd_cd = __builtin_shufflevector(c.v, d.v, 1, 5, 3, 7);
  a.v = __builtin_shufflevector(even_ab, even_cd, 0, 1, 4, 5);
  b.v = __builtin_shufflevector(odd_ab, odd_cd, 0, 1, 4, 5);
  c.v = __builtin_shufflevector(even_ab, even_cd, 2, 3, 6, 7);
  d.v = __builtin_shufflevector(odd_ab, odd_cd, 2, 3, 6, 7);
}

/// Loads the vectors of four particles, stored one after the other with three components each, and sorts them by component.
inline void load_vectors(const double *vectors, SimdPack &x, SimdPack &y, SimdPack &z)
{
  SimdPack::Vector a, b, c;
  std::memcpy(&a, vectors, sizeof a);
  std::memcpy(&b, vectors + 4, sizeof b);
  std::memcpy(&c, vectors + 8, sizeof c);
  const SimdPack::Vector x2y2x3y3 = __builtin_shufflevector(b, c, 2, 3, 5, 6),
                         y0z0y1z1 = __builtin_shufflevector(a, b, 1, 2, 4, 5);
  x.v = __builtin_shufflevector(a, x2y2x3y3, 0, 3, 4, 6);
  y.v = __builtin_shufflevector(y0z0y1z1, x2y2x3y3, 0, 2, 5, 7);
  z.v = __builtin_shufflevector(y0z0y1z1, c, 1, 3, 4, 7);
}
/// The inverse of load_vectors().
inline void store_vectors(double *vectors, const SimdPack &x, const SimdPack &y, const SimdPack &z)
{
  const SimdPack::Vector x0y0x2y2 = __builtin_shufflevector(x.v, y.v, 0, 4, 2, 6),
                         y1z1y3z3 = __builtin_shufflevector(y.v, z.v, 1, 5, 3, 7),
                         z0x1z2x3 = __builtin_shufflevector(z.v, x.v, 0, 5, 2, 7);
  const SimdPack::Vector a = __builtin_shufflevector(x0y0x2y2, z0x1z2x3, 0, 1, 4, 5),
                         b = __builtin_shufflevector(y1z1y3z3, x0y0x2y2, 0, 1, 6, 7),
                         c = __builtin_shufflevector(z0x1z2x3, y1z1y3z3, 2, 3, 6, 7);
  std::memcpy(vectors, &a, sizeof a);
  std::memcpy(vectors + 4, &b, sizeof b);
  std::memcpy(vectors + 8, &c, sizeof c);
}
} // namespace kerf::dem

template <>
struct Eigen::NumTraits<kerf::dem::SimdPack> : Eigen::GenericNumTraits<kerf::dem::SimdPack>
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
