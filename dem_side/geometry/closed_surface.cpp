// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"

#include "dem_side/geometry/closest_point.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
using Eigen::Vector3d;

[[noreturn]] void fail(const std::string &what)
{
  throw std::invalid_argument("closed surface: " + what);
}
} // namespace

ClosedSurface::ClosedSurface(int dim, const SurfaceMesh &mesh, double reach) : m_dim(dim), m_reach(reach)
{
  if (dim != 2 && dim != 3)
    fail("must be 2D or 3D");
  if (!(reach > 0.))
    fail("the reach must be positive");
  if (mesh.facets.empty())
    fail("has no facets");
  merge_points(mesh);
  find_neighbours();
  sort_into_cells();
  orient_outwards();
  compute_normals();
}

void ClosedSurface::merge_points(const SurfaceMesh &mesh)
{
  if (!mesh.points.allFinite())
    fail("has a point that is not a number");
  m_lower = mesh.points.rowwise().minCoeff();
  m_upper = mesh.points.rowwise().maxCoeff();
  // Files hold numbers of single precision, so corners that should be equal may differ by their round-off.
  const double size = (m_upper - m_lower).maxCoeff(), tolerance = 1e-6 * size;
  if (!(size > 0.))
    fail("has no extent");
  std::map<std::array<long, 3>, std::vector<int>> buckets;
  std::vector<int> number(mesh.points.cols());
  for (int i = 0; i < mesh.points.cols(); ++i)
  {
    const Vector3d x = mesh.points.col(i);
    std::array<long, 3> home;
    for (int c = 0; c < 3; ++c)
      home[c] = std::lround((x[c] - m_lower[c]) / (4. * tolerance));
    number[i] = -1;
    for (int k = 0; k < 27 && number[i] < 0; ++k)
    {
      const auto found = buckets.find({home[0] + k % 3 - 1, home[1] + k / 3 % 3 - 1, home[2] + k / 9 - 1});
      if (found != buckets.end())
        for (const int candidate : found->second)
          if ((m_points[candidate] - x).norm() <= tolerance)
            number[i] = candidate;
    }
    if (number[i] < 0)
    {
      number[i] = static_cast<int>(m_points.size());
      m_points.push_back(x);
      buckets[home].push_back(number[i]);
    }
  }
  for (const auto &facet : mesh.facets)
  {
    Facet merged = {-1, -1, -1};
    for (int k = 0; k < m_dim; ++k)
    {
      if (facet[k] < 0 || facet[k] >= mesh.points.cols())
        fail("a facet names point " + std::to_string(facet[k]) + " of " + std::to_string(mesh.points.cols()));
      merged[k] = number[facet[k]];
    }
    bool is_degenerate = merged[0] == merged[1];
    if (m_dim == 3)
      is_degenerate = is_degenerate || merged[1] == merged[2] || merged[2] == merged[0];
    if (!is_degenerate)
      m_facets.push_back(merged);
  }
  if (m_facets.empty())
    fail("has no facets with an extent");
}

void ClosedSurface::find_neighbours()
{
  // Key: the edge in 3D, the point in 2D.
  std::map<std::array<int, 2>, std::vector<std::array<int, 2>>> sides;
  for (int f = 0; f < n_facets(); ++f)
    for (int k = 0; k < m_dim; ++k)
    {
      const int a = m_facets[f][k], b = m_dim == 3 ? m_facets[f][(k + 1) % 3] : a;
      sides[{std::min(a, b), std::max(a, b)}].push_back({f, k});
    }
  int open = 0, crowded = 0;
  Vector3d where_open = Vector3d::Zero(), where_crowded = Vector3d::Zero();
  m_neighbours.assign(n_facets(), {-1, -1, -1});
  for (const auto &[key, facets] : sides)
  {
    if (facets.size() == 2)
    {
      m_neighbours[facets[0][0]][facets[0][1]] = facets[1][0];
      m_neighbours[facets[1][0]][facets[1][1]] = facets[0][0];
      continue;
    }
    const Vector3d middle = (m_points[key[0]] + m_points[key[1]]) / 2.;
    if (facets.size() < 2 && ++open == 1)
      where_open = middle;
    if (facets.size() > 2 && ++crowded == 1)
      where_crowded = middle;
  }
  if (open == 0 && crowded == 0)
    return;
  std::ostringstream text;
  const Vector3d &where = open > 0 ? where_open : where_crowded;
  const char *side = m_dim == 3 ? " edges" : " points";
  if (open > 0)
    text << "is not closed, " << open << side << " belong to one facet only, the first";
  else
    text << "touches itself, " << crowded << side << " belong to more than two facets, the first";
  text << " at " << where[0] << " " << where[1] << " " << where[2] << " m";
  fail(text.str());
}

void ClosedSurface::orient_outwards()
{
  // Alike within each connected part, then against the inside: on the inner side of a facet the ray test says inside.
  std::vector<char> done(n_facets(), 0);
  std::vector<int> part;
  for (int seed = 0; seed < n_facets(); ++seed)
  {
    if (done[seed])
      continue;
    part = {seed};
    done[seed] = 1;
    for (std::size_t p = 0; p < part.size(); ++p)
      for (int k = 0; k < m_dim; ++k)
      {
        const int other = m_neighbours[part[p]][k];
        const Facet &facet = m_facets[part[p]];
        Facet &next = m_facets[other];
        if (done[other])
          continue;
        done[other] = 1;
        part.push_back(other);
        bool same_way = false; // neighbours with the same orientation pass their common edge in opposite directions
        if (m_dim == 2)
          same_way = next[k] == facet[k];
        else
          for (int l = 0; l < 3; ++l)
            same_way = same_way || (next[l] == facet[k] && next[(l + 1) % 3] == facet[(k + 1) % 3]);
        if (same_way)
        {
          std::swap(next[0], next[1]);
          auto &sides = m_neighbours[other];
          if (m_dim == 2)
            std::swap(sides[0], sides[1]);
          else
            std::swap(sides[1], sides[2]); // edges 01, 12, 20 become 10, 02, 21
        }
      }
    // A step outwards from the largest facet of the part is the safest test.
    double largest = -1.;
    Vector3d middle = Vector3d::Zero(), normal = Vector3d::Zero();
    for (const int f : part)
    {
      const Facet &facet = m_facets[f];
      const Vector3d a = m_points[facet[0]], b = m_points[facet[1]], outward = area_vector(f);
      if (outward.norm() > largest)
      {
        largest = outward.norm();
        normal = outward.normalized();
        middle = m_dim == 2 ? Vector3d((a + b) / 2.) : Vector3d((a + b + m_points[facet[2]]) / 3.);
      }
    }
    const double step = 1e-5 * (m_upper - m_lower).maxCoeff();
    if (contains(middle + step * normal))
      for (const int f : part)
      {
        std::swap(m_facets[f][0], m_facets[f][1]);
        auto &sides = m_neighbours[f];
        m_dim == 2 ? std::swap(sides[0], sides[1]) : std::swap(sides[1], sides[2]);
      }
    double volume = 0.; // that of a cavity is negative
    for (const int f : part)
      volume += (m_points[m_facets[f][0]] - middle).dot(area_vector(f));
    if (volume > 0.)
      m_bodies.push_back(middle);
  }
}

/// Normal of a facet with its area [m^2] (2D: length [m]) as length.
Vector3d ClosedSurface::area_vector(int facet) const
{
  const Vector3d &a = m_points[m_facets[facet][0]], &b = m_points[m_facets[facet][1]];
  if (m_dim == 2)
    return {b[1] - a[1], a[0] - b[0], 0.};
  return 0.5 * (b - a).cross(m_points[m_facets[facet][2]] - a);
}

/// Whether an edge (2D: the segment) of a facet passes through another one.
bool ClosedSurface::cuts(int facet, int other) const
{
  const double nothing = 1e-6 * (m_upper - m_lower).maxCoeff(); // as in merge_points()
  const Facet &g = m_facets[other];
  const Vector3d &a = m_points[g[0]], &b = m_points[g[1]], outward = area_vector(other).normalized();
  for (int k = 0; k < (m_dim == 2 ? 1 : 3); ++k)
  {
    const Vector3d &p = m_points[m_facets[facet][k]], &q = m_points[m_facets[facet][(k + 1) % m_dim]];
    const double from = outward.dot(p - a), to = outward.dot(q - a);
    if (!((from > nothing && to < -nothing) || (from < -nothing && to > nothing)))
      continue;
    const Vector3d x = p + from / (from - to) * (q - p);
    bool inside = true;
    if (m_dim == 2)
      inside = (x - a).dot(b - a) > nothing * (b - a).norm() && (x - b).dot(a - b) > nothing * (b - a).norm();
    else
      for (int l = 0; l < 3; ++l)
      {
        const Vector3d &corner = m_points[g[l]], side = m_points[g[(l + 1) % 3]] - corner;
        inside = inside && outward.cross(side).dot(x - corner) > nothing * side.norm();
      }
    if (inside)
      return true;
  }
  return false;
}

void ClosedSurface::check_cuts() const
{
  struct Bounds
  {
    Vector3d low, high;
    int facet;
  };
  std::vector<Bounds> all;
  for (int f = 0; f < n_facets(); ++f)
  {
    all.push_back({m_points[m_facets[f][0]], m_points[m_facets[f][0]], f});
    for (int k = 1; k < m_dim; ++k)
    {
      all.back().low = all.back().low.cwiseMin(m_points[m_facets[f][k]]);
      all.back().high = all.back().high.cwiseMax(m_points[m_facets[f][k]]);
    }
  }
  std::sort(all.begin(), all.end(), [](const Bounds &a, const Bounds &b) { return a.low[0] < b.low[0]; });
  for (std::size_t i = 0; i < all.size(); ++i)
    for (std::size_t j = i + 1; j < all.size() && all[j].low[0] <= all[i].high[0]; ++j)
    {
      if ((all[i].low.array() > all[j].high.array()).any() || (all[j].low.array() > all[i].high.array()).any())
        continue;
      const Facet &f = m_facets[all[i].facet], &g = m_facets[all[j].facet];
      bool joined = false;
      for (int k = 0; k < m_dim; ++k)
        joined = joined || std::find(g.begin(), g.begin() + m_dim, f[k]) != g.begin() + m_dim;
      if (joined || !(cuts(all[i].facet, all[j].facet) || cuts(all[j].facet, all[i].facet)))
        continue;
      const Vector3d where = 0.5 * (all[i].low.cwiseMax(all[j].low) + all[i].high.cwiseMin(all[j].high));
      std::ostringstream text;
      text << "cuts itself, near " << where[0] << " " << where[1] << " " << where[2] << " m";
      fail(text.str());
    }
}

void ClosedSurface::check_one_body() const
{
  check_cuts();
  if (m_bodies.size() == 1)
    return;
  std::ostringstream text;
  text << "has " << m_bodies.size() << " pieces, one is allowed; two of them at";
  for (const std::size_t k : {0u, 1u})
    text << (k ? " and " : " ") << m_bodies[k][0] << " " << m_bodies[k][1] << " " << m_bodies[k][2];
  text << " m";
  fail(text.str());
}

double ClosedSurface::section(double y) const
{
  // The divergence theorem in the plane, over the segments in which it cuts the facets.
  const Vector3d centre = 0.5 * (m_lower + m_upper);
  double sum = 0.;
  for (int f = 0; f < n_facets(); ++f)
  {
    std::array<Vector3d, 2> ends;
    int n = 0;
    for (int k = 0; k < (m_dim == 2 ? 1 : 3); ++k)
    {
      const Vector3d &a = m_points[m_facets[f][k]], &b = m_points[m_facets[f][(k + 1) % m_dim]];
      if ((a[1] < y) != (b[1] < y))
        ends[n++] = a + (y - a[1]) / (b[1] - a[1]) * (b - a) - centre;
    }
    if (n == 0)
      continue;
    const Vector3d normal(m_normals[f][0], 0., m_normals[f][2]);
    sum += m_dim == 2 ? (normal[0] > 0. ? ends[0][0] : -ends[0][0])
                      : 0.5 * ends[0].dot(normal.normalized()) * (ends[1] - ends[0]).norm();
  }
  return sum;
}

std::vector<double> ClosedSurface::moments() const
{
  // No two axes or diagonals of a symmetric body have the same position along one of them.
  static const std::array<Vector3d, 5> directions = {
    {{0.61, 0.28, 0.11}, {-0.23, 0.52, 0.25}, {0.17, -0.34, 0.49}, {-0.41, -0.13, 0.46}, {0.37, -0.57, -0.06}}};
  constexpr int n_powers = 7;
  const Vector3d centre = 0.5 * (m_lower + m_upper);
  const double half = 0.5 * (m_upper - m_lower).maxCoeff();
  std::vector<double> result;
  for (const Vector3d &direction : directions)
  {
    std::array<double, n_powers> sum{};
    for (int f = 0; f < n_facets(); ++f)
    {
      // The simplex of the centre, where the position is 0, and the facet. Its volume has a sign.
      std::array<double, n_powers + 1> h{{1.}}; // complete homogeneous symmetric polynomials of the corners' positions
      for (int k = 0; k < m_dim; ++k)
      {
        const double s = direction.dot(m_points[m_facets[f][k]] - centre) / half;
        for (int q = 1; q <= n_powers; ++q)
          h[q] += s * h[q - 1];
      }
      const double volume = (m_points[m_facets[f][0]] - centre).dot(area_vector(f)) / m_dim;
      double factor = 1.; // q! d! / (q + d)!
      for (int q = 1; q <= n_powers; ++q)
      {
        factor *= double(q) / (q + m_dim);
        sum[q - 1] += volume * factor * h[q];
      }
    }
    for (const double value : sum)
      result.push_back(value / m_volume);
  }
  return result;
}

void ClosedSurface::compute_normals()
{
  m_normals.resize(n_facets());
  std::vector<Vector3d> at_point(m_points.size(), Vector3d::Zero());
  for (int f = 0; f < n_facets(); ++f)
  {
    const Facet &facet = m_facets[f];
    const Vector3d outward = area_vector(f);
    const double size = outward.norm();
    m_area += size;
    m_volume += (m_points[facet[0]] - m_lower).dot(outward) / m_dim;
    // A needle without area has no direction; the edges and corners take that of its neighbours.
    m_normals[f] = size > 0. ? Vector3d(outward / size) : Vector3d(Vector3d::Zero());
    for (int k = 0; k < m_dim; ++k)
    {
      double angle = 1.;
      if (m_dim == 3)
      {
        const Vector3d u = (m_points[facet[(k + 1) % 3]] - m_points[facet[k]]).normalized();
        const Vector3d v = (m_points[facet[(k + 2) % 3]] - m_points[facet[k]]).normalized();
        angle = std::acos(std::clamp(u.dot(v), -1., 1.));
      }
      at_point[facet[k]] += angle * m_normals[f];
    }
  }
  // At edges and corners, angle-weighted normals decide the side (Baerentzen & Aanaes 2005).
  m_pseudo_normals.resize(n_facets());
  for (int f = 0; f < n_facets(); ++f)
  {
    m_pseudo_normals[f].fill(m_normals[f]);
    for (int k = 0; k < m_dim; ++k)
    {
      if (m_dim == 3)
        m_pseudo_normals[f][1 + k] = m_normals[f] + m_normals[m_neighbours[f][k]];
      m_pseudo_normals[f][4 + k] = at_point[m_facets[f][k]];
    }
  }
  if (!(m_volume > 0.))
    fail("encloses no volume");
}

void ClosedSurface::sort_into_cells()
{
  // Cells about as large as the reach, but larger when there would be too many for the memory.
  const Vector3d extent = m_upper - m_lower;
  m_grid.cell_size = std::max(m_reach, extent.maxCoeff() / (m_dim == 2 ? 1000. : 150.));
  m_grid.lower = m_lower - Vector3d::Constant(m_grid.cell_size);
  for (int c = 0; c < m_dim; ++c)
    m_grid.n_cells[c] = static_cast<int>(extent[c] / m_grid.cell_size) + 3;
  const int n = m_grid.size();
  std::vector<std::vector<int>> near(n);
  m_columns.resize(std::size_t(m_grid.n_cells[1]) * m_grid.n_cells[2]);
  const double half_diagonal = 0.5 * std::sqrt(double(m_dim)) * m_grid.cell_size;
  for (int f = 0; f < n_facets(); ++f)
  {
    Vector3d low = m_points[m_facets[f][0]], high = low;
    for (int k = 1; k < m_dim; ++k)
    {
      low = low.cwiseMin(m_points[m_facets[f][k]]);
      high = high.cwiseMax(m_points[m_facets[f][k]]);
    }
    const Vector3d middle = (low + high) / 2.;
    double radius = 0.;
    for (int k = 0; k < m_dim; ++k)
      radius = std::max(radius, (m_points[m_facets[f][k]] - middle).norm());
    m_balls.emplace_back(middle[0], middle[1], middle[2], radius);
    const double slack = 1e-3 * m_grid.cell_size;
    const auto column_low = m_grid.cell_at(low.array() - slack), column_high = m_grid.cell_at(high.array() + slack);
    for (int z = column_low[2]; z <= column_high[2]; ++z)
      for (int y = column_low[1]; y <= column_high[1]; ++y)
        m_columns[std::size_t(z) * m_grid.n_cells[1] + y].push_back(f);

    const auto first = m_grid.cell_at(low.array() - m_reach), last = m_grid.cell_at(high.array() + m_reach);
    std::array<Vector3d, 3> corners;
    for (int k = 0; k < 3; ++k)
      corners[k] = m_points[m_facets[f][std::min(k, m_dim - 1)]];
    const Vector3d normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalized();
    for (int z = first[2]; z <= last[2]; ++z)
      for (int y = first[1]; y <= last[1]; ++y)
        for (int x = first[0]; x <= last[0]; ++x)
        {
          Vector3d centre = m_grid.lower + m_grid.cell_size * Vector3d(x + 0.5, y + 0.5, z + 0.5);
          int feature = 0;
          if (m_dim == 2)
            centre[2] = corners[0][2];
          const Vector3d closest = m_dim == 2 ? closest_on_segment(corners[0], corners[1], centre, 4, 5, 0, feature)
                                              : closest_on_triangle(corners, normal, centre, feature);
          if ((closest - centre).norm() <= m_reach + half_diagonal)
            near[m_grid.index(x, y, z)].push_back(f);
        }
  }
  m_first_near.assign(n + 1, 0);
  for (int c = 0; c < n; ++c)
  {
    m_first_near[c + 1] = m_first_near[c] + static_cast<int>(near[c].size());
    m_near.insert(m_near.end(), near[c].begin(), near[c].end());
  }
}

Vector3d ClosedSurface::closest_point(const Facet &facet, const Vector3d &x, int &feature) const
{
  const Vector3d &a = m_points[facet[0]], &b = m_points[facet[1]];
  if (m_dim == 2)
    return closest_on_segment(a, b, x, 4, 5, 0, feature);
  const Vector3d &c = m_points[facet[2]];
  return closest_on_triangle({a, b, c}, m_normals[&facet - m_facets.data()], x, feature);
}

const std::vector<ClosedSurface::Foot> &ClosedSurface::feet(const Vector3d &x, double within) const
{
  m_feet.clear();
  for (int c = 0; c < m_dim; ++c) // points beyond the grid are further away than the reach
    if (x[c] < m_grid.lower[c] || x[c] > m_grid.lower[c] + m_grid.n_cells[c] * m_grid.cell_size)
      return m_feet;
  const int cell = m_grid.index(m_grid.cell_at(x));
  for (int k = m_first_near[cell]; k < m_first_near[cell + 1]; ++k)
  {
    const int f = m_near[k];
    const double sight = within + m_balls[f][3];
    if ((m_balls[f].head<3>() - x).squaredNorm() > sight * sight)
      continue;
    int feature = 0;
    const Vector3d foot = closest_point(m_facets[f], x, feature), arm = x - foot;
    const double distance = arm.norm();
    if (distance >= within)
      continue;
    const Vector3d &outward = m_pseudo_normals[f][feature];
    const double side = outward.dot(arm) > 0. ? -1. : 1.;
    Vector3d inward = distance > 1e-9 * m_reach ? Vector3d(side / distance * arm) : Vector3d(-outward.normalized());
    m_feet.push_back({side * distance, inward});
  }
  std::sort(m_feet.begin(), m_feet.end(),
            [](const Foot &a, const Foot &b) { return std::abs(a.distance) < std::abs(b.distance); });
  // Facets with a common edge or corner give the same foot.
  std::size_t kept = 0;
  for (std::size_t k = 0; k < m_feet.size(); ++k)
  {
    bool is_new = true;
    for (std::size_t l = 0; l < kept && is_new; ++l)
      is_new = std::abs(m_feet[k].distance - m_feet[l].distance) > 1e-9 * m_reach ||
               (m_feet[k].inward - m_feet[l].inward).squaredNorm() > 1e-12;
    if (is_new)
      m_feet[kept++] = m_feet[k];
  }
  m_feet.resize(kept);
  return m_feet;
}

bool ClosedSurface::contains(const Vector3d &point) const
{
  // The small offset keeps a ray along a grid line of the mesh from running through its edges.
  const double nudge = 1e-7 * (m_upper - m_lower).maxCoeff();
  Vector3d x = point + nudge * Vector3d(0., 0.7312, m_dim == 3 ? 0.4177 : 0.);
  for (int c = 0; c < m_dim; ++c)
    if (x[c] < m_lower[c] || x[c] > m_upper[c])
      return false;
  const auto cell = m_grid.cell_at(x);
  bool is_inside = false;
  for (const int f : m_columns[std::size_t(cell[2]) * m_grid.n_cells[1] + cell[1]])
  {
    const Facet &facet = m_facets[f];
    const Vector3d &a = m_points[facet[0]], &b = m_points[facet[1]];
    if (m_dim == 2)
    {
      if ((a[1] > x[1]) != (b[1] > x[1]) && x[0] < a[0] + (x[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        is_inside = !is_inside;
      continue;
    }
    // The projection of the triangle along x contains the point, and the triangle is ahead.
    const Vector3d &c = m_points[facet[2]];
    const auto turn = [&x](const Vector3d &p, const Vector3d &q)
    { return (p[1] - x[1]) * (q[2] - x[2]) - (p[2] - x[2]) * (q[1] - x[1]); };
    const double u = turn(b, c), v = turn(c, a), w = turn(a, b);
    if (!((u > 0. && v > 0. && w > 0.) || (u < 0. && v < 0. && w < 0.)))
      continue;
    if ((u * a[0] + v * b[0] + w * c[0]) / (u + v + w) > x[0])
      is_inside = !is_inside;
  }
  return is_inside;
}
} // namespace kerf::dem
