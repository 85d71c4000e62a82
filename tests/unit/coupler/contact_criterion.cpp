// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/contact_criterion.h"
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

using namespace kerf;

// Hertz's line contact in its usual form: a^2 = 4 F R/(pi E*), p = 2 F/(pi a).
TEST(ContactCriterion, HalfWidthOfHertz)
{
  const fem::Material rock = {2400., 20e9, 0.25};
  const double radius = 0.03, force = 5e5, E = rock.young / (1. - 0.25 * 0.25);
  const double a = std::sqrt(4. * force * radius / (M_PI * E));
  EXPECT_NEAR(contact_half_width(radius, 2. * force / (M_PI * a), rock), a, 1e-12 * a);
}

// Cells are kept when their half contact at strength covers two of them; a plane is met by faces, which any cell resolves.
TEST(ContactCriterion, CoarseCellsOnly)
{
  const auto fem = fem::make_fem_side(fem::test::box({3., 1., 0.}, 1.));
  const fem::Material rock = {2400., 20e9, 0.25};
  const double strength = 30e6, radius = 2. / contact_half_width(1., strength, rock); // half width 2, cells of 1
  const auto cells = [&](const std::vector<NearCell> &near)
  { return cells_too_coarse_for_contact(near, strength, rock, fem->mesh()); };
  EXPECT_EQ(cells({{2, 0.99 * radius}, {0, 0.99 * radius}, {2, 0.5 * radius}}), std::vector<int>({0, 2}));
  EXPECT_TRUE(cells({{2, 1.01 * radius}, {0, std::numeric_limits<double>::infinity()}}).empty());
}
