// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/loading/boundary/tributary_areas.h"

#include "coupler/base/mesh_geometry.h"
#include "dem_side/geometry/grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
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

/// Points whose distances from two particles differ by less belong to both [mean diameters]; round-off of lattices.
constexpr double equally_near = 1e-6;

/// Normals that differ by less are the same; round-off.
constexpr double same_direction = 1e-9;

/// Search for the particles whose surfaces are nearest to a point.
class NearestSurfaces
{
public:
  NearestSurfaces(const dem::Packing &packing, const std::vector<int> &particles)
    : packing(packing), largest_radius(0.), tolerance(equally_near * packing.mean_diameter)
  {
    for (const int i : particles)
      largest_radius = std::max(largest_radius, packing.radii[i]);
    Vector3d lower = Vector3d::Constant(1e300), upper = Vector3d::Constant(-1e300);
    for (const int i : particles)
    {
      lower = lower.cwiseMin(packing.positions.col(i));
      upper = upper.cwiseMax(packing.positions.col(i));
    }
    // Across a periodic axis the images of particles near the border are candidates, too.
    const double margin = 4. * largest_radius;
    Eigen::Array3i n_images = (packing.periodic.array() > 0.).cast<int>();
    for (const int i : particles)
      for (int z = -n_images[2]; z <= n_images[2]; ++z)
        for (int y = -n_images[1]; y <= n_images[1]; ++y)
          for (int x = -n_images[0]; x <= n_images[0]; ++x)
          {
            const Vector3d place = packing.positions.col(i) + Vector3d(x, y, z).cwiseProduct(packing.periodic);
            if ((place.array() >= lower.array() - margin).all() && (place.array() <= upper.array() + margin).all())
              candidates.push_back({i, place});
          }
    bins.lower = lower.array() - margin;
    bins.cell_size = 2. * largest_radius;
    for (int c = 0; c < 3; ++c)
      bins.n_cells[c] = static_cast<int>((upper[c] + margin - bins.lower[c]) / bins.cell_size) + 1;
    std::vector<int> bin_of;
    for (const Candidate &candidate : candidates)
      bin_of.push_back(bins.index(bins.cell_at(candidate.place)));
    sorted = dem::CellSort(bin_of, bins.size());
  }

  /// The nearest particles, several if they are equally near.
  std::vector<int> of(const Vector3d &point) const
  {
    std::vector<std::pair<double, int>> near;
    double best = 1e300;
    const std::array<int, 3> middle = bins.cell_at(point);
    // Particles outside of the searched bins are at least reach bins away.
    for (int reach = 1; best > (reach - 1) * bins.cell_size - largest_radius && reach <= longest_search(); ++reach)
    {
      near.clear();
      std::array<int, 3> first, last;
      for (int c = 0; c < 3; ++c)
      {
        first[c] = std::max(0, middle[c] - reach);
        last[c] = std::min(bins.n_cells[c] - 1, middle[c] + reach);
      }
      for (int z = first[2]; z <= last[2]; ++z)
        for (int y = first[1]; y <= last[1]; ++y)
          for (int x = first[0]; x <= last[0]; ++x)
            for (int k = sorted.first[bins.index(x, y, z)]; k < sorted.first[bins.index(x, y, z) + 1]; ++k)
            {
              const Candidate &candidate = candidates[sorted.order[k]];
              const double distance = (point - candidate.place).norm() - packing.radii[candidate.particle];
              if (distance < best + tolerance)
                near.emplace_back(distance, candidate.particle);
              best = std::min(best, distance);
            }
    }
    std::vector<int> result;
    for (const auto &[distance, particle] : near)
      if (distance < best + tolerance)
        result.push_back(particle);
    return result;
  }

private:
  struct Candidate
  {
    int particle;
    Vector3d place;
  };
  int longest_search() const { return *std::max_element(bins.n_cells.begin(), bins.n_cells.end()); }

  const dem::Packing &packing;
  double largest_radius, tolerance;
  std::vector<Candidate> candidates;
  dem::Grid bins;
  dem::CellSort sorted;
};

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

std::vector<ParticleAtFace> particles_at_faces(const fem::Mesh &mesh, const std::vector<char> &faces,
                                               const dem::Packing &packing)
{
  std::vector<ParticleAtFace> found;
  if (packing.size() == 0)
    return found;
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
  double smallest_gap = largest_gap * packing.mean_diameter;
  for (std::size_t f = 0; f < faces.size(); ++f)
  {
    if (!faces[f])
      continue;
    const Face face(mesh, mesh.boundary[f]);
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

  std::vector<char> touching(packing.size(), 0);
  for (const Near &near : candidates)
  {
    if (touching[near.particle] || near.gap >= std::max(smallest_gap, 0.) + half_radius)
      continue;
    touching[near.particle] = 1;
    found.push_back({near.particle, near.normal});
  }
  std::sort(found.begin(), found.end(),
            [](const ParticleAtFace &a, const ParticleAtFace &b) { return a.particle < b.particle; });
  return found;
}

TributaryAreas::TributaryAreas(const fem::Mesh &mesh, const std::vector<char> &faces, const dem::Packing &packing,
                               const double spacing)
  : packing(packing)
{
  for (const ParticleAtFace &found : particles_at_faces(mesh, faces, packing))
    at_faces.push_back(found.particle);
  std::vector<fem::FacePoints> of_faces;
  Eigen::Index n_points = 0;
  for (std::size_t f = 0; f < faces.size() && !at_faces.empty(); ++f)
    if (faces[f])
    {
      of_faces.push_back(fem::face_points(mesh, mesh.boundary[f], spacing));
      n_points += of_faces.back().position.cols();
    }
  positions.resize(3, n_points);
  area_vectors.resize(3, n_points);
  n_points = 0;
  for (const fem::FacePoints &face : of_faces)
  {
    positions.middleCols(n_points, face.position.cols()) = face.position;
    area_vectors.middleCols(n_points, face.position.cols()) = face.area;
    n_points += face.position.cols();
  }
  if (at_faces.empty())
    return;
  const NearestSurfaces nearest(packing, at_faces);
  for (int point = 0; point < n_points; ++point)
  {
    const std::vector<int> owners = nearest.of(positions.col(point));
    for (const int owner : owners)
      parts.push_back({point, owner, 1. / owners.size()});
  }
  std::stable_sort(parts.begin(), parts.end(), [](const Part &a, const Part &b) { return a.particle < b.particle; });
  set_whole();
}

/// Sums of the weighted parts for each particle and normal. The work is proportional to the number of points.
template <typename Weight, typename Owner>
void TributaryAreas::add_up(const Weight &weight, const Owner &owner)
{
  shares.clear();
  std::vector<TributaryArea> moved;
  const auto add = [](std::vector<TributaryArea> &list, int particle, const Vector3d &normal, double area)
  {
    for (auto share = list.rbegin(); share != list.rend() && share->particle == particle; ++share)
      if ((share->normal - normal).squaredNorm() < same_direction * same_direction)
      {
        share->area += area;
        return;
      }
    list.push_back({particle, normal, area});
  };
  for (const Part &part : parts)
  {
    const double size = area_vectors.col(part.point).norm(), area = part.fraction * weight(part.point) * size;
    if (area == 0.)
      continue;
    const Vector3d normal = area_vectors.col(part.point) / size;
    if (const int particle = owner(part); particle == part.particle)
      add(shares, particle, normal, area);
    else if (particle >= 0)
      moved.push_back({particle, normal, area});
  }
  if (moved.empty())
    return;
  std::vector<TributaryArea> all = std::move(shares);
  all.insert(all.end(), moved.begin(), moved.end());
  std::stable_sort(all.begin(), all.end(),
                   [](const TributaryArea &a, const TributaryArea &b) { return a.particle < b.particle; });
  shares.clear();
  for (const TributaryArea &share : all)
    add(shares, share.particle, share.normal, share.area);
}

void TributaryAreas::set_weights(const Eigen::VectorXd &weights, const std::vector<char> &takes)
{
  const auto nearest_that_takes = [&](const int point)
  {
    double smallest = 1e300;
    int nearest = -1;
    for (const int i : at_faces)
      if (takes[i])
        if (const double distance = packing.shortest(positions.col(point) - packing.positions.col(i)).norm() - packing.radii[i];
            distance < smallest)
        {
          smallest = distance;
          nearest = i;
        }
    return nearest;
  };
  add_up([&](int point) { return weights[point]; },
         [&](const Part &part) { return takes[part.particle] ? part.particle : nearest_that_takes(part.point); });
}

void TributaryAreas::set_whole()
{
  add_up([](int) { return 1.; }, [](const Part &part) { return part.particle; });
}

std::vector<double> TributaryAreas::mean_weights() const
{
  std::vector<double> whole(packing.size(), 0.), mean(packing.size(), -1.);
  for (const Part &part : parts)
    whole[part.particle] += part.fraction * area_vectors.col(part.point).norm();
  for (std::size_t i = 0; i < mean.size(); ++i)
    if (whole[i] > 0.)
      mean[i] = 0.;
  for (const TributaryArea &share : shares)
    if (whole[share.particle] > 0.)
      mean[share.particle] += share.area / whole[share.particle];
  return mean;
}
} // namespace kerf
