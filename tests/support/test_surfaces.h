// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/geometry/closed_surface.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <fstream>

/// Closed surfaces with known volumes.
namespace kerf::dem::test
{
/// Closed polygon through the points.
inline SurfaceMesh polygon(const std::vector<Eigen::Vector3d> &corners)
{
  SurfaceMesh mesh;
  const int n = static_cast<int>(corners.size());
  mesh.points.resize(3, n);
  for (int i = 0; i < n; ++i)
  {
    mesh.points.col(i) = corners[i];
    mesh.facets.push_back({{i, (i + 1) % n, -1}});
  }
  return mesh;
}

/// A square of side a at the origin without its upper right quarter.
inline SurfaceMesh l_shape(double a)
{
  const double h = a / 2.;
  return polygon({{0., 0., 0.}, {a, 0., 0.}, {a, h, 0.}, {h, h, 0.}, {h, a, 0.}, {0., a, 0.}});
}

inline SurfaceMesh disc(int n, double radius, const Eigen::Vector3d &centre)
{
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < n; ++i)
  {
    const double angle = 2. * std::acos(-1.) * i / n;
    corners.push_back(centre + radius * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.));
  }
  return polygon(corners);
}

/// The L shape as a prism of depth z, ends divided into squares.
inline SurfaceMesh l_prism(double a, double depth)
{
  const double h = a / 2.;
  SurfaceMesh mesh;
  // Corners in the plane: the three squares' nodes.
  const double xy[8][2] = {{0., 0.}, {h, 0.}, {a, 0.}, {a, h}, {h, h}, {h, a}, {0., a}, {0., h}};
  mesh.points.resize(3, 16);
  for (int i = 0; i < 16; ++i)
    mesh.points.col(i) << xy[i % 8][0], xy[i % 8][1], i < 8 ? 0. : depth;
  const int squares[3][4] = {{0, 1, 4, 7}, {1, 2, 3, 4}, {7, 4, 5, 6}};
  for (const auto &s : squares)
    for (const int end : {0, 8})
    {
      mesh.facets.push_back({{s[0] + end, s[1] + end, s[2] + end}});
      mesh.facets.push_back({{s[0] + end, s[2] + end, s[3] + end}});
    }
  for (int i = 0; i < 8; ++i)
  {
    const int j = (i + 1) % 8;
    mesh.facets.push_back({{i, j, j + 8}});
    mesh.facets.push_back({{i, j + 8, i + 8}});
  }
  return mesh;
}

/// Octahedron whose triangles are divided into four @p divisions + 1 times, corners on the sphere.
inline SurfaceMesh sphere(int divisions, double radius, const Eigen::Vector3d &centre)
{
  using Eigen::Vector3d;
  std::vector<std::array<Vector3d, 3>> triangles;
  for (const double x : {-1., 1.})
    for (const double y : {-1., 1.})
      for (const double z : {-1., 1.})
        triangles.push_back({{Vector3d(x, 0., 0.), Vector3d(0., y, 0.), Vector3d(0., 0., z)}});
  for (int k = 0; k <= divisions; ++k)
  {
    std::vector<std::array<Vector3d, 3>> finer;
    for (const auto &[a, b, c] : triangles)
    {
      const Vector3d ab = (a + b).normalized(), bc = (b + c).normalized(), ca = (c + a).normalized();
      finer.push_back({{a, ab, ca}});
      finer.push_back({{ab, b, bc}});
      finer.push_back({{ca, bc, c}});
      finer.push_back({{ab, bc, ca}});
    }
    triangles = finer;
  }
  SurfaceMesh mesh;
  mesh.points.resize(3, 3 * triangles.size());
  for (std::size_t t = 0; t < triangles.size(); ++t)
  {
    for (int k = 0; k < 3; ++k)
      mesh.points.col(3 * t + k) = centre + radius * triangles[t][k];
    mesh.facets.push_back({{int(3 * t), int(3 * t + 1), int(3 * t + 2)}});
  }
  return mesh;
}

inline void write_stl(const SurfaceMesh &mesh, const std::string &path, bool binary)
{
  std::ofstream file(path, std::ios::binary);
  file.precision(17);
  if (binary)
  {
    const std::uint32_t count = mesh.facets.size();
    file << "solid, but binary" << std::string(80 - 17, ' ');
    file.write(reinterpret_cast<const char *>(&count), 4);
  }
  else
    file << "solid surface\n";
  for (const auto &facet : mesh.facets)
  {
    float numbers[12] = {0.f, 0.f, 0.f};
    for (int k = 0; k < 9; ++k)
      numbers[3 + k] = static_cast<float>(mesh.points(k % 3, facet[k / 3]));
    if (binary)
    {
      file.write(reinterpret_cast<const char *>(numbers), sizeof numbers);
      file.write("\0\0", 2);
      continue;
    }
    file << "facet normal 0 0 0\n outer loop\n";
    for (const int corner : facet)
      file << "  vertex " << mesh.points(0, corner) << ' ' << mesh.points(1, corner) << ' ' << mesh.points(2, corner) << '\n';
    file << " endloop\nendfacet\n";
  }
  if (!binary)
    file << "endsolid surface\n";
}
} // namespace kerf::dem::test
