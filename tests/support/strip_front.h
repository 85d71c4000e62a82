// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/mesh_geometry.h"
#include "tests/support/strip_patch.h"

/// The front of a strained strip moves on.
namespace kerf::test
{
/// Energies relative to the strain energy of the layer that was converted.
struct FrontChange
{
  double conversion = 0.; ///< came in by the change
  double kinetic = 0.;    ///< largest of the whole body afterwards
  double noise = 0.;      ///< largest kinetic energy of what was particle region before
  std::int64_t broken = 0;
};

/// Positions and rotations of a body at rest for one that has the same store and overlap.
inline void take_state(Body &body, Body &rested)
{
  const Eigen::Matrix3Xd u = rested.fem->gather(fem::NodalField::displacement);
  body.fem->set_state(u, Eigen::Matrix3Xd::Zero(3, u.cols()));
  body.model.start();
  std::unordered_map<int, int> place;
  const dem::Particles from = rested.model.dem().particles();
  for (int i = 0; i < from.n; ++i)
    place[from.index[i]] = i;
  dem::Particles to = body.model.dem().particles();
  for (int i = 0; i < to.n; ++i)
  {
    const int k = place.at(to.index[i]);
    to.position.col(i) = from.position.col(k);
    to.velocity.col(i).setZero();
    to.angular_velocity.col(i).setZero();
    std::copy(from.rotation + 4 * k, from.rotation + 4 * k + 4, to.rotation + 4 * i);
  }
  body.model.set_up_forces();
}

/// Moves the front of a body at rest by some columns of cells at once and follows it for 150 steps. One rank.
inline FrontChange move_front(Body &body, const Strip &shape, Direction direction, int cells, double eps)
{
  std::vector<int> layer;
  const fem::Mesh &mesh = body.fem->mesh();
  const double begin = shape.region_end(), end = begin + cells * shape.cell_length();
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (const double x = cell_centre(mesh, cell)[0]; x > begin && x < end)
      layer.push_back(cell);
  body.model.activate(layer);

  const fem::Material &rock = body.settings.body.material;
  const double modulus = direction == Direction::tension ? rock.lame_lambda() + 2. * rock.lame_mu() : rock.lame_mu();
  const double energy = 0.5 * modulus * eps * eps * (end - begin) * shape.height();
  FrontChange change;
  change.conversion = body.model.energies().conversion / energy;
  for (int k = 0; k < 30; ++k)
  {
    body.model.advance(5);
    change.kinetic = std::max(change.kinetic, body.model.energies().kinetic / energy);
    double in_region = 0.;
    const dem::Particles particles = body.model.dem().particles();
    for (int i = 0; i < particles.n; ++i)
      if (body.packing.positions(0, particles.index[i]) < begin)
        in_region += 0.5 * particles.mass[i] * particles.velocity.col(i).squaredNorm() +
                     0.25 * particles.mass[i] * std::pow(particles.radius[i] * particles.angular_velocity(2, i), 2);
    change.noise = std::max(change.noise, in_region / energy);
  }
  change.broken = body.model.dem().n_bonds_broken();
  return change;
}

/// The same for a random strip that has come to rest under a uniform strain. Bonds are twice as strong as the most loaded one.
inline FrontChange move_random_front(StripCase strip, Direction direction, int cells, double eps)
{
  const Strip &shape = strip.strip;
  hold_ends(strip.settings);
  strip.settings.local_damping = 0.4;
  Body rested(strip.settings, strip.packing, Mode::fixed);
  energy_at_rest(rested, direction, eps * (shape.length() - shape.cell_length()));

  double strongest[2] = {0., 0.};
  for (const dem::ActiveBond &bond : rested.model.dem().bonds())
  {
    strongest[0] = std::max(strongest[0], std::abs(bond.normal_force));
    strongest[1] = std::max(strongest[1], bond.shear_force);
  }
  strip.settings.local_damping = 0.;
  strip.settings.bond.R_n = 2. * strongest[0];
  strip.settings.bond.R_t = 2. * strongest[1];
  Body body(strip.settings, strip.packing, rested.dt);
  take_state(body, rested);
  return move_front(body, shape, direction, cells, eps);
}
} // namespace kerf::test
