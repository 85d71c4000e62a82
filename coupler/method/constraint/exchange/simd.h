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

/// Several entries of particles to a cell at once: SimdLanes are one number of four entries; a SimdPack is vectors as they
/// stand in the arrays of particles and nodes, x y of four entries in the plane and x y z of two in space, which come and go
/// without being sorted by component; where many numbers belong to an entry, it is one number of eight.
namespace kerf
{
constexpr int n_simd_lanes = 4;
typedef double SimdLanes __attribute__((vector_size(n_simd_lanes * sizeof(double))));
typedef double LinkPair __attribute__((vector_size(2 * sizeof(double))));
typedef double SimdPack __attribute__((vector_size(8 * sizeof(double))));

typedef float FloatPack __attribute__((vector_size(8 * sizeof(float))));

/// What is kept of a pack in single precision, to move half as much.
[[gnu::always_inline]] inline FloatPack narrowed(const SimdPack &v)
{
#ifdef __AVX512F__
  return _mm512_cvtpd_ps(v); // GCC 12 makes many instructions of the conversion of vectors
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

/// What a pack holds and how it comes and goes.
template <int dim>
struct PackedVectors;

/// Both one after the other.
[[gnu::always_inline]] inline SimdPack joined(const SimdLanes &first, const SimdLanes &last)
{
#ifdef __AVX512F__
  return _mm512_insertf64x4(_mm512_castpd256_pd512(first), last, 1); // for a shuffle GCC 12 copies both before
#else
  return __builtin_shufflevector(first, last, 0, 1, 2, 3, 4, 5, 6, 7);
#endif
}

template <>
struct PackedVectors<2>
{
  using One = LinkPair; ///< x y
  static constexpr int components = 2, interpolation = 4;

  [[gnu::always_inline]] static One load_one(const double *v) { return *reinterpret_cast<const AnyPair *>(v); }
  [[gnu::always_inline]] static void store_one(double *v, const One &one) { *reinterpret_cast<AnyPair *>(v) = one; }
  /// The vectors of some particles, which begin at these numbers of an array.
  [[gnu::always_inline]] static SimdPack load(const double *v, const std::ptrdiff_t *begin)
  {
    const auto two = [&](int l) -> SimdLanes
    { return __builtin_shufflevector(load_one(v + begin[l]), load_one(v + begin[l + 1]), 0, 1, 2, 3); };
    return joined(two(0), two(2));
  }
  /// Lanes that repeat the particle before them do not count: the last ones go first.
  [[gnu::always_inline]] static void store(double *v, const std::ptrdiff_t *begin, const SimdPack &pack)
  {
    store_one(v + begin[3], __builtin_shufflevector(pack, pack, 6, 7));
    store_one(v + begin[2], __builtin_shufflevector(pack, pack, 4, 5));
    store_one(v + begin[1], __builtin_shufflevector(pack, pack, 2, 3));
    store_one(v + begin[0], __builtin_shufflevector(pack, pack, 0, 1));
  }
  /// The number of each entry for all of its components. The integer is the number of the pack in the batch.
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
  /// Sum over the entries.
  [[gnu::always_inline]] static One fold(const SimdPack &v)
  {
    const SimdLanes two = __builtin_shufflevector(v, v, 0, 1, 2, 3) + __builtin_shufflevector(v, v, 4, 5, 6, 7);
    return __builtin_shufflevector(two, two, 0, 1) + __builtin_shufflevector(two, two, 2, 3);
  }

  /// sum of arm x force
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
  typedef LinkPair AnyPair __attribute__((aligned(alignof(double)))); // begins at any number
};

template <>
struct PackedVectors<3>
{
  using One = SimdLanes; ///< x y z and nothing
  static constexpr int components = 4, interpolation = 2;

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
    // Not masked: what is read next to it would wait for the whole.
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

/// Eight entries at once, a number of each: vectors sorted by component. Link @p slot of packs one after the other is lane
/// lane_of(slot).
constexpr int n_octet = 8;
template <int dim>
constexpr int lane_of(int slot)
{
  return dim == 2 ? slot : slot / 2 + 4 * (slot % 2);
}
/// The vectors of eight particles, which begin at these numbers of an array, by component.
template <int dim>
[[gnu::always_inline]] inline std::array<SimdPack, dim> load_octet(const double *v, const std::ptrdiff_t *begin)
{
  const auto pack = [&](int p) { return PackedVectors<dim>::load(v, begin + PackedVectors<dim>::interpolation * p); };
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
      last = __builtin_shufflevector(c, d, 0, 8, 2, 10, 4, 12, 6, 14),               // of c and d
      first_y = __builtin_shufflevector(a, b, 1, 9, 3, 11, 5, 13, 7, 15),
                   last_y = __builtin_shufflevector(c, d, 1, 9, 3, 11, 5, 13, 7, 15);
    return {{__builtin_shufflevector(first, last, 0, 1, 8, 9, 4, 5, 12, 13),
             __builtin_shufflevector(first_y, last_y, 0, 1, 8, 9, 4, 5, 12, 13),
             __builtin_shufflevector(first, last, 2, 3, 10, 11, 6, 7, 14, 15)}};
  }
}
/// Adds to them; lanes that repeat a particle must be zero.
template <int dim>
[[gnu::always_inline]] inline void add_octet(double *v, const std::ptrdiff_t *begin,
                                             const std::array<SimdPack, dim> &by_component)
{
  using Vectors = PackedVectors<dim>;
  const auto add = [&](int p, const SimdPack &pack)
  {
    const std::ptrdiff_t *at = begin + Vectors::interpolation * p;
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
/// The sums of eight.
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

/// Packs of a batch of entries.
template <int dim>
constexpr int n_packs = n_simd_lanes / PackedVectors<dim>::interpolation;

/// Asks the memory for what is needed soon after @p begin, @p n at a time.
template <typename Element>
[[gnu::always_inline]] inline void fetch_after(const std::vector<Element> &values, std::size_t begin, std::size_t n = 1,
                                               int distance = 16)
{
  constexpr int line = 64;
  const char *soon = reinterpret_cast<const char *>(values.data() + begin + distance * n);
  for (std::size_t at = 0; at < n * sizeof(Element); at += line)
    __builtin_prefetch(soon + at);
}

/// The same for the particles' vectors of the group of entries that comes @p distance after; they are scattered.
template <typename Group, typename... Arrays>
[[gnu::always_inline]] inline void fetch_vectors_after(const std::vector<Group> &groups, int group, int distance,
                                                       const Arrays &...arrays)
{
  if (group + distance < static_cast<int>(groups.size()))
    for (const std::ptrdiff_t begin : groups[group + distance].begin)
      (__builtin_prefetch(arrays.data() + begin), ...);
}

/// The nearest image, where space repeats itself after @p period [m].
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
