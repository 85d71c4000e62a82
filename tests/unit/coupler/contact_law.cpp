// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/contact_law.h"

#include <gtest/gtest.h>

using namespace kerf;
using Eigen::Vector3d;

TEST(ContactLaw, SpringWithoutTensionAndCoulombBound)
{
  const ContactLaw law{0.3};
  const Vector3d n = Vector3d::UnitY();
  EXPECT_EQ(law.force(1e-6, n, Vector3d::Zero(), 1e9, 10.), Vector3d::Zero());
  EXPECT_NEAR(law.force(-1e-3, n, Vector3d::Zero(), 1e9, 10.)[1], 1e6, 1e-6);
  // Separating fast: the dashpot would pull, the contact must not.
  EXPECT_EQ(law.force(-1e-9, n, Vector3d(0., 1e3, 0.), 1e9, 1e6)[1], 0.);
  // Sliding fast: exactly mu F_n against the sliding velocity. Sliding slowly: the dashpot alone.
  const Vector3d fast = law.force(-1e-3, n, Vector3d(1e9, 0., 0.), 1e9, 10.);
  EXPECT_NEAR(fast[0], -0.3 * 1e6, 1e-6);
  EXPECT_NEAR(law.force(-1e-3, n, Vector3d(1e-2, 0., 0.), 1e9, 10.)[0], -0.1, 1e-12);
}
