// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/soft_packing.h"

#include "dem_side/cell_list.h"

namespace kerf::dem
{
SoftPacking::SoftPacking(int dim, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, Eigen::Matrix3Xd positions,
                         std::vector<double> radii, double mean_radius)
  : m_dim(dim), m_size(static_cast<int>(radii.size())), m_lower(lower), m_upper(upper), m_mean_radius(mean_radius),
    m_skin(0.4 * mean_radius), m_radii(std::move(radii)), m_positions(std::move(positions))
{
  for (const double r : m_radii)
    m_largest = std::max(m_largest, r);
  m_velocities.setZero(3, m_size);
  m_forces.setZero(3, m_size);
}

Eigen::VectorXd SoftPacking::radii() const
{
  Eigen::VectorXd result(m_size);
  for (int i = 0; i < m_size; ++i)
    result[i] = m_scale * m_radii[i];
  return result;
}

void SoftPacking::update_neighbours()
{
  if (m_positions_at_update.cols() == m_size)
  {
    double largest_square = 0.;
    for (int i = 0; i < m_size; ++i)
    {
      double square = 0.;
      for (int c = 0; c < m_dim; ++c)
      {
        const double d = m_positions(c, i) - m_positions_at_update(c, i);
        square += d * d;
      }
      largest_square = std::max(largest_square, square);
    }
    if (4. * largest_square < m_skin * m_skin)
      return;
  }
  m_neighbours.clear();
  const CellList cells(m_positions, 2. * max_scale * m_largest + m_skin);
  cells.for_each_pair(
    [&](int i, int j)
    {
      const double reach = max_scale * (m_radii[i] + m_radii[j]) + m_skin;
      double square = 0.;
      for (int c = 0; c < m_dim; ++c)
      {
        const double d = m_positions(c, j) - m_positions(c, i);
        square += d * d;
      }
      if (square < reach * reach)
        m_neighbours.push_back({i, j});
    });
  m_positions_at_update = m_positions;
}

double SoftPacking::compute_forces()
{
  update_neighbours();
  m_forces.setZero();
  m_overlap_sum = 0.;
  m_contacts = 0;
  for (const auto &[i, j] : m_neighbours)
  {
    const double reach = m_scale * (m_radii[i] + m_radii[j]);
    const double *x_i = m_positions.data() + 3 * i, *x_j = m_positions.data() + 3 * j;
    double d[3] = {0., 0., 0.}, square = 0.;
    for (int c = 0; c < m_dim; ++c)
    {
      d[c] = x_j[c] - x_i[c];
      square += d[c] * d[c];
    }
    if (square >= reach * reach || square == 0.)
      continue;
    const double distance = std::sqrt(square), overlap = reach - distance;
    for (int c = 0; c < m_dim; ++c)
    {
      const double f = overlap / distance * d[c];
      m_forces(c, i) -= f;
      m_forces(c, j) += f;
    }
    m_overlap_sum += overlap;
    ++m_contacts;
  }
  double force_square = 0.;
  for (int i = 0; i < m_size; ++i)
    for (int c = 0; c < m_dim; ++c)
    {
      const double r = m_scale * m_radii[i], x = m_positions(c, i);
      const double below = r - (x - m_lower[c]), above = r - (m_upper[c] - x);
      // A stiffer wall keeps the sides flat to a fraction of the overlap between particles.
      m_forces(c, i) += 2. * (std::max(below, 0.) - std::max(above, 0.));
      force_square += m_forces(c, i) * m_forces(c, i);
    }
  return force_square;
}

void SoftPacking::move(double dt)
{
  for (int i = 0; i < m_size; ++i)
    for (int c = 0; c < m_dim; ++c)
    {
      m_velocities(c, i) += dt * m_forces(c, i);
      m_positions(c, i) += dt * m_velocities(c, i);
    }
}

void SoftPacking::anneal(double final_scale, double speed, int steps, std::mt19937_64 &random,
                         const std::function<void(double)> &progress)
{
  const double initial_scale = m_scale;
  for (int i = 0; i < m_size; ++i)
    for (int c = 0; c < m_dim; ++c)
      m_velocities(c, i) = uniform(random) - 0.5;
  for (int step = 0; step < steps; ++step)
  {
    const double done = double(step) / steps;
    m_scale = initial_scale + (final_scale - initial_scale) * done;
    if (step % 10 == 0)
    {
      double square = 0.;
      for (int i = 0; i < m_size; ++i)
        for (int c = 0; c < m_dim; ++c)
          square += m_velocities(c, i) * m_velocities(c, i);
      const double target = speed * m_mean_radius * (1. - done);
      const double factor = square > 0. ? target / std::sqrt(square / (m_dim * m_size)) : 0.;
      for (int i = 0; i < m_size; ++i)
        for (int c = 0; c < m_dim; ++c)
          m_velocities(c, i) *= factor;
    }
    if (progress && step % 100 == 0)
      progress(done);
    compute_forces();
    move(0.3); // central difference is stable to 2/omega = 0.7 at eight contacts
  }
}

int SoftPacking::minimise(double tolerance, int max_steps)
{
  const double dt_max = 0.45, alpha_start = 0.1;
  double dt = 0.2, alpha = alpha_start;
  int downhill = 0;
  m_velocities.setZero();
  for (int step = 0; step < max_steps; ++step)
  {
    const double force_square = compute_forces();
    const double mean_force = m_contacts ? m_overlap_sum / m_contacts : 0.;
    if (m_contacts == 0 || force_square <= tolerance * tolerance * mean_force * mean_force * m_size)
      return step;
    double power = 0., speed_square = 0.;
    for (int i = 0; i < m_size; ++i)
      for (int c = 0; c < m_dim; ++c)
      {
        power += m_forces(c, i) * m_velocities(c, i);
        speed_square += m_velocities(c, i) * m_velocities(c, i);
      }
    if (power > 0.)
    {
      const double toward_force = alpha * std::sqrt(speed_square / force_square);
      for (int i = 0; i < m_size; ++i)
        for (int c = 0; c < m_dim; ++c)
          m_velocities(c, i) = (1. - alpha) * m_velocities(c, i) + toward_force * m_forces(c, i);
      if (++downhill > 5)
      {
        dt = std::min(1.1 * dt, dt_max);
        alpha *= 0.99;
      }
    }
    else
    {
      m_velocities.setZero();
      dt *= 0.5;
      alpha = alpha_start;
      downhill = 0;
    }
    move(dt);
  }
  compute_forces();
  return max_steps;
}
} // namespace kerf::dem
