// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <Eigen/Core>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

#ifdef __AVX512F__
#include <immintrin.h>
#endif

/// Vector types for several tied particles at once. SimdLanes hold one number of four particles. A SimdPack holds vectors in
/// the layout of the arrays of particles and nodes: x y of four particles in two dimensions, x y z of two particles in three.
/// So vectors are loaded and stored without sorting by component. Where a particle has many numbers, a SimdPack holds one
/// number of eight particles.
namespace kerf
{
constexpr int n_simd_lanes = 4;
typedef double SimdLanes __attribute__((vector_size(n_simd_lanes * sizeof(double))));
typedef double SimdPair __attribute__((vector_size(2 * sizeof(double))));
typedef double SimdPack __attribute__((vector_size(8 * sizeof(double))));

typedef float FloatPack __attribute__((vector_size(8 * sizeof(float))));

/// Converts a pack to single precision, which halves the memory traffic.
[[gnu::always_inline]] inline FloatPack narrowed(const SimdPack &v)
{
#ifdef __AVX512F__
  return _mm512_cvtpd_ps(v); // GCC 12 converts vectors with many instructions
#else
  return __builtin_convertvector(v, FloatPack);
#endif
}
[[gnu::always_inline]] inline SimdPack widened(const FloatPack &v)
{
#ifdef __AVX512F__
  return _mm512_cvtps_pd(v);
#else
  return __builtin_convertvector(v, SimdPack);
#endif
}

inline double sum_of(const SimdLanes &v)
{
  return (v[0] + v[1]) + (v[2] + v[3]);
}
inline double sum_of(const SimdPack &v)
{
  return sum_of(__builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7));
}

/// Layout of a pack, and how it is loaded and stored.
template <int dim>
struct PackedVectors;

/// Concatenates both.
[[gnu::always_inline]] inline SimdPack joined(const SimdLanes &first, const SimdLanes &last)
{
#ifdef __AVX512F__
  return _mm512_insertf64x4(_mm512_castpd256_pd512(first), last, 1); // GCC 12 copies both before a shuffle
#else
  return __builtin_shufflevector(first, last, 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}

template <>
struct PackedVectors<2>
{
  using One = SimdPair; ///< x y
  static constexpr int components = 2, n_entries = 4;

  [[gnu::always_inline]] static One load_one(const double *v) { return *reinterpret_cast<const AnyPair *>(v); }
  [[gnu::always_inline]] static void store_one(double *v, const One &one) { *reinterpret_cast<AnyPair *>(v) = one; }
  /// Loads the vectors that begin at these positions of an array.
  [[gnu::always_inline]] static SimdPack load(const double *v, const std::ptrdiff_t *begin)
  {
    const auto two = [&](int l) -> SimdLanes
    { return __builtin_shufflevector(load_one(v + begin[l]), load_one(v + begin[l + 1]), 0, 1, 2, 3); };
    return joined(two(0), two(2));
  }
  /// Stores the vectors. Unused lanes repeat the particle before them, so the last lanes are stored first and overwritten.
  [[gnu::always_inline]] static void store(double *v, const std::ptrdiff_t *begin, const SimdPack &pack)
  {
    store_one(v + begin[3], __builtin_shufflevector(pack, pack, 6, 7));
    store_one(v + begin[2], __builtin_shufflevector(pack, pack, 4, 5));
    store_one(v + begin[1], __builtin_shufflevector(pack, pack, 2, 3));
    store_one(v + begin[0], __builtin_shufflevector(pack, pack, 0, 1));
  }
  /// Repeats the number of each particle for all of its components. The integer is the number of the pack in the batch.
  [[gnu::always_inline]] static SimdPack spread(const SimdLanes &v, int /*number*/)
  {
    return __builtin_shufflevector(v, v, 0, 0, 1, 1, 2, 2, 3, 3);
  }
  /// The same vector for all entries.
  [[gnu::always_inline]] static SimdPack repeat(const One &v)
  {
#ifdef __AVX512DQ__
    return _mm512_broadcast_f64x2(v); // a shuffle to a wider vector goes through memory
#else
    return SimdPack{v[0], v[1], v[0], v[1], v[0], v[1], v[0], v[1]};
#endif
  }
  /// Sum over the particles.
  [[gnu::always_inline]] static One fold(const SimdPack &v)
  {
    const SimdLanes two = __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
    return __builtin_shufflevector(two, two, 0, 1) + __builtin_shufflevector(two, two, 2, 3);
  }

  /// Sum of arm x force over the particles.
  class Couple
  {
  public:
    [[gnu::always_inline]] void add(const SimdPack &arm, const SimdPack &force)
    {
      products += arm * __builtin_shufflevector(force, force, 1, 0, 3, 2, 5, 4, 7, 6);
    }
    Eigen::Vector3d sum() const
    {
      const One both = fold(products);
      return {0., 0., both[0] - both[1]};
    }

  private:
    SimdPack products = {};
  };

private:
  typedef SimdPair AnyPair __attribute__((aligned(alignof(double)))); // without alignment to pairs
};

template <>
struct PackedVectors<3>
{
  using One = SimdLanes; ///< x y z and an unused lane
  static constexpr int components = 4, n_entries = 2;

  [[gnu::always_inline]] static One load_one(const double *v)
  {
#ifdef __AVX512VL__
    return _mm256_maskz_loadu_pd(0b111, v);
#else
    return One{v[0], v[1], v[2], 0.};
#endif
  }
  [[gnu::always_inline]] static void store_one(double *v, const One &one)
  {
    // Not a masked store: a load of a neighbouring vector would wait for it.
    PackedVectors<2>::store_one(v, __builtin_shufflevector(one, one, 0, 1));
    v[2] = one[2];
  }
  [[gnu::always_inline]] static SimdPack load(const double *v, const std::ptrdiff_t *begin)
  {
    return joined(load_one(v + begin[0]), load_one(v + begin[1]));
  }
  [[gnu::always_inline]] static void store(double *v, const std::ptrdiff_t *begin, const SimdPack &pack)
  {
    store_one(v + begin[1], __builtin_shufflevector(pack, pack, 4, 5, 6, 7));
    store_one(v + begin[0], __builtin_shufflevector(pack, pack, 0, 1, 2, 3));
  }
  [[gnu::always_inline]] static SimdPack spread(const SimdLanes &v, int number)
  {
    return number == 0 ? __builtin_shufflevector(v, v, 0, 0, 0, 0, 1, 1, 1, 1)
                       : __builtin_shufflevector(v, v, 2, 2, 2, 2, 3, 3, 3, 3);
  }
  [[gnu::always_inline]] static SimdPack repeat(const One &v)
  {
#ifdef __AVX512F__
    return _mm512_broadcast_f64x4(v);
#else
    return SimdPack{v[0], v[1], v[2], v[3], v[0], v[1], v[2], v[3]};
#endif
  }
  [[gnu::always_inline]] static One fold(const SimdPack &v)
  {
    return __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
  }

  class Couple
  {
  public:
    [[gnu::always_inline]] void add(const SimdPack &arm, const SimdPack &force)
    {
      next += arm * __builtin_shufflevector(force, force, 1, 2, 0, 3, 5, 6, 4, 7);
      last += arm * __builtin_shufflevector(force, force, 2, 0, 1, 3, 6, 4, 5, 7);
    }
    Eigen::Vector3d sum() const
    {
      const One a = fold(next), b = fold(last); // a: x y, y z, z x of arm and force; b: x z, y x, z y
      return {a[1] - b[2], a[2] - b[0], a[0] - b[1]};
    }

  private:
    SimdPack next = {}, last = {};
  };
};

/// One number of each of eight particles, for vectors sorted by component. The particle at @p slot of consecutive packs has the
/// lane lane_of(slot).
constexpr int n_octet = 8;
template <int dim>
constexpr int lane_of(int slot)
{
  return dim == 2 ? slot : slot / 2 + 4 * (slot % 2);
}
/// Loads the vectors of eight particles that begin at these positions of an array, sorted by component.
template <int dim>
[[gnu::always_inline]] inline std::array<SimdPack, dim> load_octet(const double *v, const std::ptrdiff_t *begin)
{
  const auto pack = [&](int p) { return PackedVectors<dim>::load(v, begin + PackedVectors<dim>::n_entries * p); };
  if constexpr (dim == 2)
  {
    const SimdPack a = pack(0), b = pack(1);
    return {
      {__builtin_shufflevector(a, b, 0, 2, 4, 6, 8, 10, 12, 14), __builtin_shufflevector(a, b, 1, 3, 5, 7, 9, 11, 13, 15)}};
  }
  else
  {
    const SimdPack a = pack(0), b = pack(1), c = pack(2), d = pack(3);
    const SimdPack first = __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14), // x z of a and b
      last = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14),               // x z of c and d
      first_y = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15),
                   last_y = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    return {{__builtin_shufflevector(first, last, 0, 1, 8, 9, 4, 5, 12, 13),
             __builtin_shufflevector(first_y, last_y, 0, 1, 8, 9, 4, 5, 12, 13),
             __builtin_shufflevector(first, last, 2, 3, 10, 11, 6, 7, 14, 15)}};
  }
}
/// Adds to the vectors of eight particles. Lanes that repeat a particle must be zero.
template <int dim>
[[gnu::always_inline]] inline void add_octet(double *v, const std::ptrdiff_t *begin,
                                             const std::array<SimdPack, dim> &by_component)
{
  using Vectors = PackedVectors<dim>;
  const auto add = [&](int p, const SimdPack &pack)
  {
    const std::ptrdiff_t *at = begin + Vectors::n_entries * p;
    Vectors::store(v, at, Vectors::load(v, at) + pack);
  };
  if constexpr (dim == 2)
  {
    const auto &[x, y] = by_component;
    add(0, __builtin_shufflevector(x, y, 0, 8, 1, 9, 2, 10, 3, 11));
    add(1, __builtin_shufflevector(x, y, 4, 12, 5, 13, 6, 14, 7, 15));
  }
  else
  {
    const auto &[x, y, z] = by_component;
    const SimdPack even = __builtin_shufflevector(x, y, 0, 8, 2, 10, 4, 12, 6, 14),
                   odd = __builtin_shufflevector(x, y, 1, 9, 3, 11, 5, 13, 7, 15);
    add(0, __builtin_shufflevector(even, z, 0, 1, 8, 8, 4, 5, 12, 12));
    add(1, __builtin_shufflevector(odd, z, 0, 1, 9, 9, 4, 5, 13, 13));
    add(2, __builtin_shufflevector(even, z, 2, 3, 10, 10, 6, 7, 14, 14));
    add(3, __builtin_shufflevector(odd, z, 2, 3, 11, 11, 6, 7, 15, 15));
  }
}
/// The sums over each of eight packs.
[[gnu::always_inline]] inline SimdPack sums_of(const SimdPack (&v)[8])
{
  const auto pairs = [](const SimdPack &a, const SimdPack &b) -> SimdPack {
    return __builtin_shufflevector(a, b, 0, 8, 2, 10, 4, 12, 6, 14) + __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15);
  };
  const auto halves = [](const SimdPack &a, const SimdPack &b) -> SimdPack {
    return __builtin_shufflevector(a, b, 0, 1, 4, 5, 8, 9, 12, 13) + __builtin_shufflevector(a, b, 2, 3, 6, 7, 10, 11, 14, 15);
  };
  return halves(halves(pairs(v[0], v[1]), pairs(v[2], v[3])), halves(pairs(v[4], v[5]), pairs(v[6], v[7])));
}

/// Number of packs in a batch.
template <int dim>
constexpr int n_packs = n_simd_lanes / PackedVectors<dim>::n_entries;

/// Prefetches @p n elements that are needed @p distance times n after @p begin.
template <typename Element>
[[gnu::always_inline]] inline void fetch_after(const std::vector<Element> &values, std::size_t begin, std::size_t n = 1,
                                               int distance = 16)
{
  constexpr int line = 64;
  const char *soon = reinterpret_cast<const char *>(values.data() + begin + distance * n);
  for (std::size_t at = 0; at < n * sizeof(Element); at += line)
    __builtin_prefetch(soon + at);
}

/// Prefetches the scattered particle vectors of the group that follows @p distance groups later.
template <typename Group, typename... Arrays>
[[gnu::always_inline]] inline void fetch_vectors_after(const std::vector<Group> &groups, int group, int distance,
                                                       const Arrays &...arrays)
{
  if (group + distance < static_cast<int>(groups.size()))
    for (const std::ptrdiff_t begin : groups[group + distance].begin)
      (__builtin_prefetch(arrays.data() + begin), ...);
}

/// Reduces @p gap to the nearest periodic image. @param period of the periodic axes, 0 in others [m]
template <int dim>
void wrap(SimdPack &gap, const Eigen::Vector3d &period)
{
  for (int k = 0; k < 8; ++k)
    if (const int c = k % PackedVectors<dim>::components; c < dim && period[c] > 0.)
      gap[k] -= period[c] * std::round(gap[k] / period[c]);
}
inline void wrap(SimdPack &gap, double period)
{
  for (int l = 0; l < n_octet; ++l)
    gap[l] -= period * std::round(gap[l] / period);
}
} // namespace kerf
