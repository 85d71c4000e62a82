// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/graded_axis.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

namespace kerf::fem
{
namespace
{
/// Sizes h g, h g^2, ... of n cells, none above the bound.
std::vector<double> geometric_sizes(const double h, const double growth, const double bound, const int n)
{
  std::vector<double> sizes(n);
  double size = h;
  for (double &s : sizes)
    s = size = std::min(size * growth, bound);
  return sizes;
}

double total(const std::vector<double> &sizes)
{
  return std::accumulate(sizes.begin(), sizes.end(), 0.);
}

int smallest_number_reaching(const double length, const double h, const double growth, const double bound)
{
  int n = 0;
  double size = h, sum = 0.;
  while (sum < length * (1. - 1e-12))
  {
    size = std::min(size * growth, bound);
    sum += size;
    ++n;
  }
  return n;
}

/// Sizes of the cells that fill the length, from the fine zone outwards; empty when fewer cells than one of size h fit.
std::vector<double> graded_sizes(const double length, const double h, const double growth, const double bound)
{
  const int n = smallest_number_reaching(length, h, growth, bound);
  if (n * h > length)
    return {};
  // n cells with the full growth are too long and with no growth too short: the growth that fits lies between.
  double low = 1., high = growth;
  for (int i = 0; i < 100; ++i)
  {
    const double middle = 0.5 * (low + high);
    (total(geometric_sizes(h, middle, bound, n)) < length ? low : high) = middle;
  }
  return geometric_sizes(h, high, bound, n);
}
} // namespace

std::vector<double> vertex_coordinates(const GradedAxis &axis)
{
  const double h = axis.cell_size;
  const double bound =
    axis.largest_cell_size > 0. ? std::max(axis.largest_cell_size, h) : std::numeric_limits<double>::infinity();
  double a = std::clamp(axis.fine_lower, axis.lower, axis.upper);
  double b = std::clamp(axis.fine_upper, axis.lower, axis.upper);
  if (!(b > a))
  {
    a = axis.lower;
    b = axis.upper;
  }

  const std::vector<double> below = graded_sizes(a - axis.lower, h, axis.growth, bound);
  const std::vector<double> above = graded_sizes(axis.upper - b, h, axis.growth, bound);
  if (below.empty())
    a = axis.lower;
  if (above.empty())
    b = axis.upper;

  std::vector<double> x = {axis.lower};
  for (auto size = below.rbegin(); size != below.rend(); ++size)
    x.push_back(x.back() + *size);
  x.back() = a;
  const int n_fine = std::max(1, static_cast<int>(std::lround((b - a) / h)));
  for (int i = 1; i <= n_fine; ++i)
    x.push_back(a + (b - a) * i / n_fine);
  for (const double size : above)
    x.push_back(x.back() + size);
  x.back() = axis.upper;
  return x;
}
} // namespace kerf::fem
