// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <vector>

namespace kerf::test
{
/// Particles that live in plain arrays.
struct DummyParticles
{
  explicit DummyParticles(const Eigen::Matrix3Xd &positions, double particle_mass = 1.)
    : x(positions), v(Eigen::Matrix3Xd::Zero(3, x.cols())), w(v), f(v), t(v), m(x.cols(), particle_mass), r(x.cols(), 0.5),
      weight(x.cols(), 0.5), index(x.cols())
  {
    for (std::size_t i = 0; i < index.size(); ++i)
      index[i] = static_cast<int>(i);
  }
  dem::Particles view()
  {
    dem::Particles particles;
    particles.n = static_cast<int>(x.cols());
    particles.index = index.data();
    new (&particles.position) dem::Vectors(x.data(), 3, x.cols());
    new (&particles.velocity) dem::Vectors(v.data(), 3, x.cols());
    new (&particles.angular_velocity) dem::Vectors(w.data(), 3, x.cols());
    new (&particles.force) dem::Vectors(f.data(), 3, x.cols());
    new (&particles.torque) dem::Vectors(t.data(), 3, x.cols());
    particles.mass = m.data();
    particles.radius = r.data();
    particles.weight = weight.data();
    return particles;
  }
  Eigen::Matrix3Xd x, v, w, f, t;
  std::vector<double> m, r, weight;
  std::vector<int> index;
};
} // namespace kerf::test
