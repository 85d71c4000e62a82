// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace kerf::fem
{
#if defined(__AVX512F__)
inline constexpr int n_lanes = 8;
#elif defined(__AVX__)
inline constexpr int n_lanes = 4;
#else
inline constexpr int n_lanes = 2;
#endif

/// As many doubles as one instruction of the host processes. deal.II's own vectors are not used because it may be built without
/// the host's instructions.
typedef double Lanes __attribute__((vector_size(n_lanes * sizeof(double))));

inline double sum_of_lanes(const Lanes &value)
{
  double sum = 0.;
  for (int l = 0; l < n_lanes; ++l)
    sum += value[l];
  return sum;
}

/// Nodal arrays of the kernels. Displacement and force of a node are adjacent, and each is one aligned load or store of 2 or 4
/// doubles. So a cell touches one place for each node, and loads do not collide with stores of another array at the same offset
/// of a page.
template <int dim>
inline constexpr int node_width = dim == 2 ? 2 : 4;
/// Distance between nodes, in doubles.
template <int dim>
inline constexpr int node_stride = 2 * node_width<dim>;

namespace lanes
{
typedef double Pair __attribute__((vector_size(2 * sizeof(double))));
typedef double Quad __attribute__((vector_size(4 * sizeof(double))));

/// Pairs also come from callers' vectors, of any alignment.
typedef Pair AnyPair __attribute__((aligned(sizeof(double))));
inline Pair pair(const double *p)
{
  return *reinterpret_cast<const AnyPair *>(p);
}
inline Quad quad(const double *p)
{
  return *reinterpret_cast<const Quad *>(p);
}
inline void add(double *p, const Pair value)
{
  *reinterpret_cast<AnyPair *>(p) += value;
}
inline void add(double *p, const Quad value)
{
  *reinterpret_cast<Quad *>(p) += value;
}
} // namespace lanes

/// Components of the nodes at @p offset, one node a lane.
template <int dim>
inline void gather(const double *values, const int (&offset)[n_lanes], Lanes (&v)[dim])
{
  using namespace lanes;
#if defined(__AVX512F__)
  if constexpr (dim == 3)
  {
    const auto two = [&](const int a, const int b)
    { return __builtin_shufflevector(quad(values + offset[a]), quad(values + offset[b]), 0, 1, 2, 3, 4, 5, 6, 7); };
    const Lanes r0 = two(0, 4), r1 = two(1, 5), r2 = two(2, 6), r3 = two(3, 7);
    const Lanes xz01 = __builtin_shufflevector(r0, r1, 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes xz23 = __builtin_shufflevector(r2, r3, 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes y01 = __builtin_shufflevector(r0, r1, 1, 9, 3, 11, 5, 13, 7, 15);
    const Lanes y23 = __builtin_shufflevector(r2, r3, 1, 9, 3, 11, 5, 13, 7, 15);
    v[0] = __builtin_shufflevector(xz01, xz23, 0, 1, 8, 9, 4, 5, 12, 13);
    v[1] = __builtin_shufflevector(y01, y23, 0, 1, 8, 9, 4, 5, 12, 13);
    v[2] = __builtin_shufflevector(xz01, xz23, 2, 3, 10, 11, 6, 7, 14, 15);
  }
  else
  {
    const auto two = [&](const int a, const int b)
    { return __builtin_shufflevector(pair(values + offset[a]), pair(values + offset[b]), 0, 1, 2, 3); };
    const Lanes even = __builtin_shufflevector(two(0, 2), two(4, 6), 0, 1, 2, 3, 4, 5, 6, 7);
    const Lanes odd = __builtin_shufflevector(two(1, 3), two(5, 7), 0, 1, 2, 3, 4, 5, 6, 7);
    v[0] = __builtin_shufflevector(even, odd, 0, 8, 2, 10, 4, 12, 6, 14);
    v[1] = __builtin_shufflevector(even, odd, 1, 9, 3, 11, 5, 13, 7, 15);
  }
#elif defined(__AVX__)
  if constexpr (dim == 3)
  {
    const Quad r0 = quad(values + offset[0]), r1 = quad(values + offset[1]);
    const Quad r2 = quad(values + offset[2]), r3 = quad(values + offset[3]);
    const Quad xz01 = __builtin_shufflevector(r0, r1, 0, 4, 2, 6), xz23 = __builtin_shufflevector(r2, r3, 0, 4, 2, 6);
    const Quad y01 = __builtin_shufflevector(r0, r1, 1, 5, 3, 7), y23 = __builtin_shufflevector(r2, r3, 1, 5, 3, 7);
    v[0] = __builtin_shufflevector(xz01, xz23, 0, 1, 4, 5);
    v[1] = __builtin_shufflevector(y01, y23, 0, 1, 4, 5);
    v[2] = __builtin_shufflevector(xz01, xz23, 2, 3, 6, 7);
  }
  else
  {
    const auto two = [&](const int a, const int b)
    { return __builtin_shufflevector(pair(values + offset[a]), pair(values + offset[b]), 0, 1, 2, 3); };
    const Lanes even = two(0, 2), odd = two(1, 3);
    v[0] = __builtin_shufflevector(even, odd, 0, 4, 2, 6);
    v[1] = __builtin_shufflevector(even, odd, 1, 5, 3, 7);
  }
#else
  for (int c = 0; c < dim; ++c)
    for (int l = 0; l < n_lanes; ++l)
      v[c][l] = values[offset[l] + c];
#endif
}

/// The transpose of gather(): adds node after node, because lanes may share nodes.
template <int dim>
inline void scatter_add(const Lanes (&v)[dim], const int (&offset)[n_lanes], double *values)
{
  using namespace lanes;
#if defined(__AVX512F__)
  if constexpr (dim == 3)
  {
    const Lanes zero = {};
    const Lanes xy_even = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes xy_odd = __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
    const Lanes z_even = __builtin_shufflevector(v[2], zero, 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes z_odd = __builtin_shufflevector(v[2], zero, 1, 9, 3, 11, 5, 13, 7, 15);
    const auto two = [&](const Lanes r, const int a, const int b)
    {
      add(values + offset[a], __builtin_shufflevector(r, r, 0, 1, 2, 3));
      add(values + offset[b], __builtin_shufflevector(r, r, 4, 5, 6, 7));
    };
    two(__builtin_shufflevector(xy_even, z_even, 0, 1, 8, 9, 4, 5, 12, 13), 0, 4);
    two(__builtin_shufflevector(xy_odd, z_odd, 0, 1, 8, 9, 4, 5, 12, 13), 1, 5);
    two(__builtin_shufflevector(xy_even, z_even, 2, 3, 10, 11, 6, 7, 14, 15), 2, 6);
    two(__builtin_shufflevector(xy_odd, z_odd, 2, 3, 10, 11, 6, 7, 14, 15), 3, 7);
  }
  else
  {
    const Lanes even = __builtin_shufflevector(v[0], v[1], 0, 8, 2, 10, 4, 12, 6, 14);
    const Lanes odd = __builtin_shufflevector(v[0], v[1], 1, 9, 3, 11, 5, 13, 7, 15);
    add(values + offset[0], __builtin_shufflevector(even, even, 0, 1));
    add(values + offset[1], __builtin_shufflevector(odd, odd, 0, 1));
    add(values + offset[2], __builtin_shufflevector(even, even, 2, 3));
    add(values + offset[3], __builtin_shufflevector(odd, odd, 2, 3));
    add(values + offset[4], __builtin_shufflevector(even, even, 4, 5));
    add(values + offset[5], __builtin_shufflevector(odd, odd, 4, 5));
    add(values + offset[6], __builtin_shufflevector(even, even, 6, 7));
    add(values + offset[7], __builtin_shufflevector(odd, odd, 6, 7));
  }
#elif defined(__AVX__)
  const Lanes even = __builtin_shufflevector(v[0], v[1], 0, 4, 2, 6), odd = __builtin_shufflevector(v[0], v[1], 1, 5, 3, 7);
  if constexpr (dim == 3)
  {
    const Lanes zero = {};
    const Lanes z_even = __builtin_shufflevector(v[2], zero, 0, 4, 2, 6),
                z_odd = __builtin_shufflevector(v[2], zero, 1, 5, 3, 7);
    add(values + offset[0], __builtin_shufflevector(even, z_even, 0, 1, 4, 5));
    add(values + offset[1], __builtin_shufflevector(odd, z_odd, 0, 1, 4, 5));
    add(values + offset[2], __builtin_shufflevector(even, z_even, 2, 3, 6, 7));
    add(values + offset[3], __builtin_shufflevector(odd, z_odd, 2, 3, 6, 7));
  }
  else
  {
    add(values + offset[0], __builtin_shufflevector(even, even, 0, 1));
    add(values + offset[1], __builtin_shufflevector(odd, odd, 0, 1));
    add(values + offset[2], __builtin_shufflevector(even, even, 2, 3));
    add(values + offset[3], __builtin_shufflevector(odd, odd, 2, 3));
  }
#else
  for (int l = 0; l < n_lanes; ++l)
    for (int c = 0; c < dim; ++c)
      values[offset[l] + c] += v[c][l];
#endif
}
} // namespace kerf::fem
