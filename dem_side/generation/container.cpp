// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/container.h"

namespace kerf::dem
{
Container::Container(const PackingSettings &settings, double reach)
  : m_dim(settings.dim), m_lower(settings.lower), m_upper(settings.upper), m_periodic(settings.periodic)
{
  if (settings.surface)
  {
    m_surface = std::make_unique<ClosedSurface>(m_dim, *settings.surface, reach);
    m_lower = m_surface->lower();
    m_upper = m_surface->upper();
  }
  if (m_dim == 2)
    m_lower[2] = m_upper[2] = 0.;
}

double Container::volume() const
{
  return m_surface ? m_surface->volume() : box_volume(m_dim, m_lower, m_upper);
}

double Container::area() const
{
  if (m_surface)
    return m_surface->area();
  const Eigen::Vector3d side = m_upper - m_lower;
  double half = 0.;
  for (int k = 0; k < m_dim; ++k)
  {
    const int normal = (k + m_dim - 1) % m_dim;
    if (!m_periodic[normal])
      half += m_dim == 2 ? side[1 - normal] : side[(normal + 1) % 3] * side[(normal + 2) % 3];
  }
  return 2. * half;
}

bool Container::contains(const Eigen::Vector3d &x) const
{
  if (m_surface)
    return m_surface->contains(x);
  for (int c = 0; c < m_dim; ++c)
    if (x[c] < m_lower[c] || x[c] > m_upper[c])
      return false;
  return true;
}

const std::vector<Container::Wall> &Container::walls(const Eigen::Vector3d &x, double within) const
{
  m_walls.clear();
  if (!m_surface)
  {
    for (int c = 0; c < m_dim; ++c)
    {
      if (m_periodic[c])
        continue;
      if (x[c] - m_lower[c] < within)
        m_walls.push_back({x[c] - m_lower[c], Eigen::Vector3d::Unit(c)});
      if (m_upper[c] - x[c] < within)
        m_walls.push_back({m_upper[c] - x[c], -Eigen::Vector3d::Unit(c)});
    }
    return m_walls;
  }
  const double cos_of_corner = 0.9;
  for (const ClosedSurface::Foot &foot : m_surface->feet(x, within))
  {
    // For a point outside, only the nearest wall is listed.
    bool is_new = m_walls.empty() || (m_walls.front().distance > 0. && foot.distance > 0.);
    for (const Wall &wall : m_walls)
      is_new = is_new && wall.inward.dot(foot.inward) < cos_of_corner;
    if (is_new)
      m_walls.push_back({foot.distance, foot.inward});
  }
  return m_walls;
}
} // namespace kerf::dem
