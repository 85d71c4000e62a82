// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/exchange/simd.h"
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf;

namespace
{
/// Vectors of eight particles by component and back.
template <int dim>
void sort_by_component()
{
  const Eigen::Matrix3Xd before = fem::test::noise_field(30, 1., 8, 3);
  Eigen::Matrix3Xd after = before;
  const std::ptrdiff_t begin[] = {6, 0, 81, 12, 45, 33, 60, 60}; // the last one is the one before it again
  std::array<SimdPack, dim> lanes = load_octet<dim>(before.data(), begin);
  for (int slot = 0; slot < n_octet; ++slot)
    for (int c = 0; c < dim; ++c)
    {
      EXPECT_EQ(lanes[c][lane_of<dim>(slot)], before.data()[begin[slot] + c]);
      if (slot == n_octet - 1)
        lanes[c][lane_of<dim>(slot)] = 0.;
    }
  add_octet<dim>(after.data(), begin, lanes);
  Eigen::Matrix3Xd expected = before;
  for (int slot = 0; slot < n_octet - 1; ++slot)
    expected.col(begin[slot] / 3).head<dim>() *= 2.;
  EXPECT_EQ(after, expected);

  SimdPack rows[8];
  for (int k = 0; k < 8; ++k)
    for (int l = 0; l < 8; ++l)
      rows[k][l] = 10. * k + l;
  for (int k = 0; k < 8; ++k)
    EXPECT_EQ(sums_of(rows)[k], 80. * k + 28.);
}
} // namespace

TEST(Octet, SortsByComponentInPlane)
{
  sort_by_component<2>();
}

TEST(Octet, SortsByComponentInSpace)
{
  sort_by_component<3>();
}
