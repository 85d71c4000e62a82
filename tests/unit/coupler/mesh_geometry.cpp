// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/base/mesh_geometry.h"

#include <gtest/gtest.h>

#include <random>

using namespace kerf;
using Eigen::Vector3d;

// A general convex quadrilateral against densely sampled distance: sampling step s gives an error below s.
TEST(DistanceToCell, ConvexQuadrilateral)
{
  fem::Mesh mesh;
  mesh.nodes.resize(3, 4);
  mesh.nodes << 0., 2., 0.3, 1.6, 0., 0.4, 1.1, 1.9, 0., 0., 0., 0.; // lexicographic corners
  mesh.cells.resize(4, 1);
  mesh.cells << 0, 1, 2, 3;
  std::mt19937 random(5);
  std::uniform_real_distribution<double> coordinate(-1., 3.);
  for (int k = 0; k < 200; ++k)
  {
    const Vector3d x(coordinate(random), coordinate(random), 0.);
    double sampled = 1e300;
    constexpr int n = 400;
    for (int i = 0; i <= n; ++i)
      for (int j = 0; j <= n; ++j)
      {
        const double s = double(i) / n, t = double(j) / n;
        const Vector3d point = (1 - s) * (1 - t) * mesh.nodes.col(0) + s * (1 - t) * mesh.nodes.col(1) +
                               (1 - s) * t * mesh.nodes.col(2) + s * t * mesh.nodes.col(3);
        sampled = std::min(sampled, (point - x).norm());
      }
    const double distance = distance_to_cell(mesh, 0, x);
    EXPECT_LE(distance, sampled + 1e-12);
    EXPECT_GE(distance, sampled - 2. * 2. / n);
  }
}

// A sheared brick has plane faces; its distance is that of the nearest of many points on its surface, to their spacing squared
// over twice the distance, and the spacing where that is small. Inside it is zero.
TEST(DistanceToCell, ConvexHexahedron)
{
  fem::Mesh mesh;
  mesh.dim = 3;
  mesh.nodes.resize(3, 8);
  mesh.cells.resize(8, 1);
  Eigen::Matrix3d shape;
  shape << 1., 0.3, -0.1, 0., 0.8, 0.2, 0.1, 0., 1.2;
  for (int a = 0; a < 8; ++a)
  {
    mesh.nodes.col(a) = shape * Vector3d(a & 1, (a >> 1) & 1, a >> 2);
    mesh.cells(a, 0) = a;
  }
  constexpr int n = 60;
  std::vector<Vector3d> surface;
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 2; ++side)
      for (int i = 0; i <= n; ++i)
        for (int j = 0; j <= n; ++j)
        {
          Vector3d x;
          x[axis] = side;
          x[(axis + 1) % 3] = double(i) / n;
          x[(axis + 2) % 3] = double(j) / n;
          surface.push_back(shape * x);
        }
  std::mt19937 random(9);
  std::uniform_real_distribution<double> coordinate(-0.7, 1.7);
  int n_inside = 0;
  for (int k = 0; k < 300; ++k)
  {
    const Vector3d natural(coordinate(random), coordinate(random), coordinate(random)), x = shape * natural;
    const double distance = distance_to_cell(mesh, 0, x);
    if ((natural.array() >= 0.).all() && (natural.array() <= 1.).all())
    {
      EXPECT_EQ(distance, 0.);
      ++n_inside;
      continue;
    }
    double sampled = 1e300;
    for (const Vector3d &point : surface)
      sampled = std::min(sampled, (point - x).norm());
    EXPECT_LE(distance, sampled + 1e-14);
    EXPECT_GE(distance, sampled - 1.3 / n);
    if (distance > 0.1)
      EXPECT_GE(distance, sampled - 1.3 * 1.3 / (n * n) / (2. * distance));
  }
  EXPECT_GT(n_inside, 5);
}
