// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/laguerre.h"

#include "dem_side/geometry/cell_list.h"

#include <Eigen/Geometry>

namespace kerf::dem
{
namespace
{
using Eigen::Vector3d;
using Polygon = std::vector<Vector3d>;

/// A convex body around the origin. Seen from outside, the corners of its faces are in counter-clockwise order.
class ConvexCell
{
public:
  explicit ConvexCell(const Vector3d &half)
  {
    for (int c = 0; c < 3; ++c)
      for (const double side : {-1., 1.})
      {
        Polygon face;
        for (const auto &[u, v] : {std::pair(-1., -1.), {1., -1.}, {1., 1.}, {-1., 1.}})
        {
          Vector3d corner;
          corner[c] = side;
          corner[(c + 1) % 3] = side * u;
          corner[(c + 2) % 3] = v;
          face.push_back(corner.cwiseProduct(half));
        }
        faces.push_back(face);
      }
  }

  /// Cuts off the part beyond the plane at @p offset from the origin with the unit normal @p normal.
  void cut(const Vector3d &normal, double offset)
  {
    bool is_hit = false;
    for (const Polygon &face : faces)
      for (const Vector3d &corner : face)
        is_hit = is_hit || normal.dot(corner) > offset;
    if (!is_hit)
      return;
    Polygon lid;
    std::vector<Polygon> kept;
    for (const Polygon &face : faces)
    {
      Polygon rest;
      for (std::size_t k = 0; k < face.size(); ++k)
      {
        const Vector3d &a = face[k], &b = face[(k + 1) % face.size()];
        const double height_a = normal.dot(a) - offset, height_b = normal.dot(b) - offset;
        if (height_a <= 0.)
          rest.push_back(a);
        if ((height_a <= 0.) != (height_b <= 0.))
        {
          rest.push_back(a + height_a / (height_a - height_b) * (b - a));
          lid.push_back(rest.back());
        }
      }
      if (rest.size() > 2)
        kept.push_back(std::move(rest));
    }
    faces = std::move(kept);
    if (lid.size() < 3)
      return;
    Vector3d centre = Vector3d::Zero();
    for (const Vector3d &x : lid)
      centre += x / double(lid.size());
    const Vector3d u = normal.unitOrthogonal(), v = normal.cross(u);
    std::vector<std::pair<double, int>> order;
    for (std::size_t k = 0; k < lid.size(); ++k)
      order.emplace_back(std::atan2(v.dot(lid[k] - centre), u.dot(lid[k] - centre)), k);
    std::sort(order.begin(), order.end());
    Polygon sorted;
    for (const auto &[angle, k] : order)
      sorted.push_back(lid[k]);
    faces.push_back(std::move(sorted));
  }

  double volume() const
  {
    double six_volumes = 0.;
    for (const Polygon &face : faces)
      for (std::size_t k = 1; k + 1 < face.size(); ++k)
        six_volumes += face[0].dot(face[k].cross(face[k + 1]));
    return six_volumes / 6.;
  }

  double radius() const
  {
    double square = 0.;
    for (const Polygon &face : faces)
      for (const Vector3d &corner : face)
        square = std::max(square, corner.squaredNorm());
    return std::sqrt(square);
  }

private:
  std::vector<Polygon> faces;
};
} // namespace

Eigen::VectorXd laguerre_volumes(const Packing &packing, const std::vector<char> &selected)
{
  Eigen::VectorXd volumes = Eigen::VectorXd::Zero(packing.size());
  if (packing.size() == 0)
    return volumes;
  const double unit = packing.radii.maxCoeff() * 2., sight = 2.5 * unit;
  std::vector<std::vector<std::pair<double, int>>> neighbours(packing.size());
  CellList(packing.positions, sight, packing.periodic)
    .for_each_pair(
      [&](int i, int j)
      {
        if (!selected[i] && !selected[j])
          return;
        const double distance = packing.branch(i, j).norm();
        if (distance >= sight || distance == 0.)
          return;
        if (selected[i])
          neighbours[i].emplace_back(distance, j);
        if (selected[j])
          neighbours[j].emplace_back(distance, i);
      });
  const double half_height = packing.dim == 2 ? 0.5 : 1.25; // in units; in 2D a slice of height 1
  for (int i = 0; i < packing.size(); ++i)
  {
    if (!selected[i])
      continue;
    std::sort(neighbours[i].begin(), neighbours[i].end());
    ConvexCell cell({1.25, 1.25, half_height});
    double radius = cell.radius();
    for (const auto &[distance, j] : neighbours[i])
    {
      const double power = packing.radii[i] * packing.radii[i] - packing.radii[j] * packing.radii[j];
      const double offset = (distance * distance + power) / (2. * distance) / unit;
      if (offset > radius)
        continue;
      cell.cut(packing.branch(i, j) / distance, offset);
      radius = cell.radius();
    }
    volumes[i] = cell.volume() * std::pow(unit, packing.dim);
    neighbours[i] = {};
  }
  return volumes;
}
} // namespace kerf::dem
