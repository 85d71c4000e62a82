// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/dem_side.h"

#include <cmath>
#include <vector>

namespace kerf::dem::benchmarks
{
/// What a simple program without a particle engine does in a step, as a yardstick: structs in sorted arrays, half of the pairs,
/// incremental shear, failure check, contact damping, velocity Verlet. Three dimensions; broken bonds only disappear; no
/// contacts, no lists, no ghosts, no energies.
class PlainBondLoop
{
public:
  PlainBondLoop(const Packing &packing, const BondParameters &bond, double density, double time_step)
    : bond(bond), dt(time_step)
  {
    for (int i = 0; i < packing.size(); ++i)
    {
      Particle p{};
      for (int c = 0; c < 3; ++c)
        p.x[c] = packing.positions(c, i);
      p.radius = packing.radii[i];
      p.mass = density * packing.volume(i);
      particles.push_back(p);
    }
    for (const auto &[i, j] : packing.bonds)
    {
      Bond b{};
      b.i = i;
      b.j = j;
      b.rest_length = (packing.positions.col(j) - packing.positions.col(i)).norm();
      const double m = particles[i].mass * particles[j].mass / (particles[i].mass + particles[j].mass);
      b.viscosity = 2. * bond.damping * std::sqrt(m * bond.k_n);
      bonds.push_back(b);
    }
  }

  struct Particle
  {
    double x[3], v[3], spin[3], force[3], torque[3];
    double radius, mass;
  };
  std::vector<Particle> particles; ///< velocities are on the step between calls of advance()

  int n_broken() const { return broken; }

  void advance(int steps)
  {
    for (int n = 0; n < steps; ++n)
    {
      for (Particle &p : particles)
      {
        kick(p);
        for (int c = 0; c < 3; ++c)
        {
          p.x[c] += dt * p.v[c];
          p.force[c] = p.torque[c] = 0.;
        }
      }
      if (bond.damping > 0.)
        bond_loads<true>();
      else
        bond_loads<false>();
      for (Particle &p : particles)
        kick(p);
    }
  }

private:
  struct Bond
  {
    int i, j;
    double rest_length, viscosity;
    double shear[3]; ///< displacement of j against i across the bond
    bool intact = true;
  };

  void kick(Particle &p) const
  {
    const double by_mass = 0.5 * dt / p.mass, by_inertia = by_mass / (0.4 * p.radius * p.radius);
    for (int c = 0; c < 3; ++c)
    {
      p.v[c] += by_mass * p.force[c];
      p.spin[c] += by_inertia * p.torque[c];
    }
  }

  template <bool damped>
  void bond_loads()
  {
    const double tangential = std::sqrt(bond.k_t / bond.k_n);
    for (Bond &b : bonds)
    {
      if (!b.intact)
        continue;
      Particle &p = particles[b.i], &q = particles[b.j];
      double n[3] = {q.x[0] - p.x[0], q.x[1] - p.x[1], q.x[2] - p.x[2]};
      const double distance = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
      for (double &component : n)
        component /= distance;
      const double share = p.radius / (p.radius + q.radius);
      const double arm_p = share * distance, arm_q = (1. - share) * distance;

      // Velocity of q against p at the contact point.
      double roll[3], v[3];
      for (int c = 0; c < 3; ++c)
        roll[c] = arm_p * p.spin[c] + arm_q * q.spin[c];
      v[0] = q.v[0] - p.v[0] - (roll[1] * n[2] - roll[2] * n[1]);
      v[1] = q.v[1] - p.v[1] - (roll[2] * n[0] - roll[0] * n[2]);
      v[2] = q.v[2] - p.v[2] - (roll[0] * n[1] - roll[1] * n[0]);
      const double v_n = n[0] * v[0] + n[1] * v[1] + n[2] * v[2];

      // The shear of the step before, laid into the plane across the bond, plus the slip of this one.
      const double out_of_plane = n[0] * b.shear[0] + n[1] * b.shear[1] + n[2] * b.shear[2];
      double square = 0.;
      for (int c = 0; c < 3; ++c)
      {
        b.shear[c] += dt * (v[c] - v_n * n[c]) - out_of_plane * n[c];
        square += b.shear[c] * b.shear[c];
      }
      const double elongation = distance - b.rest_length;
      const double strength = bond.R_t - bond.shear_friction * bond.k_n * std::fmin(0., elongation);
      if (bond.k_n * elongation >= bond.R_n || bond.k_t * bond.k_t * square >= strength * strength)
      {
        b.intact = false;
        ++broken;
        continue;
      }

      double force[3];
      for (int c = 0; c < 3; ++c)
        force[c] = bond.k_n * elongation * n[c] + bond.k_t * b.shear[c];
      if constexpr (damped)
        for (int c = 0; c < 3; ++c)
          force[c] += b.viscosity * (v_n * n[c] + tangential * (v[c] - v_n * n[c]));
      const double moment[3] = {n[1] * force[2] - n[2] * force[1], n[2] * force[0] - n[0] * force[2],
                                n[0] * force[1] - n[1] * force[0]};
      for (int c = 0; c < 3; ++c)
      {
        p.force[c] += force[c];
        q.force[c] -= force[c];
        p.torque[c] += arm_p * moment[c];
        q.torque[c] += arm_q * moment[c];
      }
    }
  }

  BondParameters bond;
  double dt;
  std::vector<Bond> bonds;
  int broken = 0;
};
} // namespace kerf::dem::benchmarks
