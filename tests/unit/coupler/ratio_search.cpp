// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/calibration/ratio_search.h"

#include <gtest/gtest.h>

#include <cmath>
#include <utility>

using namespace kerf;

namespace
{
/// Where the search ends for a given law of the ratio, and how often it asks; 0: out of reach.
template <typename Law>
std::pair<double, int> search_ratio(const Law &law, double target)
{
  RatioSearch search;
  double q = 1.5;
  for (int n = 1; n < 30; ++n)
  {
    const double off = std::log(law(q) / target);
    if (std::abs(off) < 0.005)
      return {q, n};
    search.add(q, off);
    q = search.next();
    if (q == 0.)
      return {0., n};
  }
  return {-1., 30};
}
} // namespace

// A rising ratio, as in two dimensions, and one with its largest value at q = 1, as in three.
TEST(RatioSearch, FindsTheRatioOnEitherSideOfATurn)
{
  const auto rising = [](double q) { return 3. * std::sqrt(q); };
  for (const double q : {0.3, 1., 1.6, 5.})
  {
    const auto [found, n] = search_ratio(rising, rising(q));
    EXPECT_NEAR(found, q, 0.02 * q);
    EXPECT_LE(n, 9);
  }
  const auto turning = [](double q) { return 10. / (1. + std::pow(std::log(q), 2)); };
  for (const double ratio : {9.5, 8., 6.})
    EXPECT_NEAR(turning(search_ratio(turning, ratio).first), ratio, 0.01 * ratio);
}

TEST(RatioSearch, KnowsWhenItIsOutOfReach)
{
  const auto turning = [](double q) { return 10. / (1. + std::pow(std::log(q), 2)); };
  EXPECT_EQ(search_ratio(turning, 11.).first, 0.);
  EXPECT_EQ(search_ratio([](double q) { return 3. * std::sqrt(q); }, 20.).first, 0.);
}
