// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/boundary/tributary_areas.h"

#include "coupler/base/mesh_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
/// A lattice may end this far before a face, since its last row need not fit: half the distance of rows [mean diameters].
constexpr double largest_gap = 0.5;

/// Particles end at a face when their gap to it exceeds the smallest one by less than half a mean radius [mean diameters]. The
/// rows of a lattice are farther apart, so only its last row ends there.
constexpr double gap_range = 0.25;

/// Geometry of a face of the boundary.
struct Face
{
  Face(const fem::Mesh &mesh, const fem::BoundaryFace &face)
  {
    const int n = mesh.dim == 2 ? 2 : 4;
    for (int k = 0; k < n; ++k)
      corner.col(k) = mesh.nodes.col(face.nodes[k]);
    lower = corner.leftCols(n).rowwise().minCoeff();
    upper = corner.leftCols(n).rowwise().maxCoeff();
    const Vector3d along = corner.col(1) - corner.col(0);
    // Lexicographic corners: 0 and 3 are opposite.
    const Vector3d area_vector = mesh.dim == 2
                                   ? Vector3d(along[1], -along[0], 0.)
                                   : Vector3d(0.5 * (corner.col(3) - corner.col(0)).cross(corner.col(2) - corner.col(1)));
    area = area_vector.norm();
    normal = area_vector / area;
    if (normal.dot(corner.leftCols(n).rowwise().mean() - cell_centre(mesh, face.cell)) < 0.)
      normal = -normal;
  }

  Eigen::Matrix<double, 3, 4> corner;
  Vector3d lower, upper, normal;
  double area;
};
} // namespace

std::vector<TributaryArea> tributary_areas(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing)
{
  std::vector<TributaryArea> shares;
  if (packing.size() == 0)
    return shares;
  const double half_radius = gap_range * packing.mean_diameter;
  const double reach = packing.radii.maxCoeff() + half_radius + largest_gap * packing.mean_diameter;
  std::vector<int> by_x(packing.size());
  std::iota(by_x.begin(), by_x.end(), 0);
  const auto x_of = [&](int i) { return packing.positions(0, i); };
  std::sort(by_x.begin(), by_x.end(), [&](int a, int b) { return x_of(a) < x_of(b); });

  struct Near
  {
    int particle;
    double gap;
    Vector3d normal;
  };
  std::vector<Near> candidates;
  double face_area = 0., smallest_gap = largest_gap * packing.mean_diameter;
  for (std::size_t f = 0; f < faces.size(); ++f)
  {
    if (!faces[f])
      continue;
    const Face face(mesh, mesh.boundary[f]);
    face_area += face.area;
    for (auto it =
           std::lower_bound(by_x.begin(), by_x.end(), face.lower[0] - reach, [&](int i, double x) { return x_of(i) < x; });
         it != by_x.end() && x_of(*it) <= face.upper[0] + reach; ++it)
    {
      const Vector3d x = packing.positions.col(*it);
      if ((x.array() < face.lower.array() - reach).any() || (x.array() > face.upper.array() + reach).any())
        continue;
      const double gap = distance_to_face(mesh, mesh.boundary[f], x) - packing.radii[*it];
      candidates.push_back({*it, gap, face.normal});
      smallest_gap = std::min(smallest_gap, gap);
    }
  }

  double section_area = 0.;
  std::vector<char> touching(packing.size(), 0);
  for (const Near &near : candidates)
  {
    if (touching[near.particle] || near.gap >= std::max(smallest_gap, 0.) + half_radius)
      continue;
    touching[near.particle] = 1;
    const double radius = packing.radii[near.particle], section = mesh.dim == 2 ? 2. * radius : M_PI * radius * radius;
    section_area += section;
    shares.push_back({near.particle, near.normal, section});
  }
  for (TributaryArea &share : shares)
    share.area *= face_area / section_area;
  std::sort(shares.begin(), shares.end(),
            [](const TributaryArea &a, const TributaryArea &b) { return a.particle < b.particle; });
  return shares;
}
} // namespace kerf
