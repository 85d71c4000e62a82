// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rank_borders.h"

#include <gtest/gtest.h>

using namespace kerf::dem;

namespace
{
/// 8 points in the second quarter of the axis, 2 in the last.
const std::vector<double> counts = {0., 8., 0., 2.};

void expect_near(const Borders &a, const Borders &b)
{
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k)
    EXPECT_NEAR(a[k], b[k], 1e-14) << "border " << k; // round-off of numbers up to one
}
} // namespace

TEST(Slabs, HoldEqualNumbers)
{
  expect_near(balanced_borders(counts, 2, 0.), {0., 0.25 + 0.25 * 5. / 8., 1.});
  expect_near(balanced_borders(counts, 5, 0.), {0., 0.3125, 0.375, 0.4375, 0.5, 1.});
  for (const int n : {1, 2, 3, 5, 7})
    EXPECT_NEAR(imbalance(counts, balanced_borders(counts, n, 0.)), 1., 1e-14) << n;
  EXPECT_NEAR(imbalance(counts, {0., 0.5, 1.}), 1.6, 1e-14);
}

TEST(Slabs, AreNotThinnerThanAsked)
{
  expect_near(balanced_borders(counts, 5, 0.1), {0., 0.3125, 0.4125, 0.5125, 0.6125, 1.});
  expect_near(balanced_borders({0., 0., 0., 1.}, 4, 0.2), {0., 0.4, 0.6, 0.8, 1.}); // pushed back from the end
  expect_near(balanced_borders(counts, 4, 0.25), {0., 0.25, 0.5, 0.75, 1.});        // no room
  expect_near(balanced_borders({0., 0.}, 2, 0.1), {0., 0.5, 1.});                   // nothing there
}

// What lay in a segment comes to a neighbour at most: no border passes the old place of the next one.
TEST(Slabs, ApproachInSteps)
{
  const Borders equal = {0., 0.25, 0.5, 0.75, 1.}, target = {0., 0.05, 0.1, 0.15, 1.};
  const Borders first = approach(equal, target, 0.01), second = approach(first, target, 0.01);
  expect_near(first, {0., 0.05, 0.26, 0.51, 1.});
  expect_near(second, {0., 0.05, 0.1, 0.27, 1.});
  expect_near(approach(second, target, 0.01), target);
}
