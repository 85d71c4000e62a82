// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/tool/tool_path.h"

#include <gtest/gtest.h>

using namespace kerf;
using Eigen::Vector3d;

// Straight parts of the path are exact (1e-13: round-off of an integral of size 10 over a window of 0.2), the velocity is the
// derivative of the position and has no jumps.
TEST(ToolPath, SmoothAndExact)
{
  const double window = 0.2;
  const ToolPath path({{0., Vector3d(0., 1., 0.)}, {1., Vector3d(0., 0., 0.)}, {3., Vector3d(4., 0., 0.)}}, window);
  EXPECT_LT((path.position(0.5) - Vector3d(0., 0.5, 0.)).norm(), 1e-13);
  EXPECT_LT((path.velocity(0.5) - Vector3d(0., -1., 0.)).norm(), 1e-13);
  EXPECT_LT((path.position(2.) - Vector3d(2., 0., 0.)).norm(), 1e-13);
  EXPECT_LT((path.position(5.) - Vector3d(4., 0., 0.)).norm(), 1e-13);
  EXPECT_LT(path.velocity(5.).norm(), 1e-14);
  const double step = 1e-6;
  for (double t = -0.3; t < 3.5; t += 0.0137)
  {
    const Vector3d slope = (path.position(t + step) - path.position(t - step)) / (2. * step);
    EXPECT_LT((slope - path.velocity(t)).norm(), 1e-5); // central difference: kinks of the velocity give step/window
    EXPECT_LT((path.velocity(t + step) - path.velocity(t)).norm(), 2. * step * 3. / window); // bounded acceleration
  }
}
