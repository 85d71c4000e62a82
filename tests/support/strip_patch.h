// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "tests/support/coupled_strip.h"

#include <gtest/gtest.h>

/// Static patch test of a random strip.
namespace kerf::test
{
enum class Direction
{
  tension = 0, ///< u_x = eps x
  shear = 1    ///< u_y = gamma x
};
inline Eigen::Vector3d unit(Direction direction)
{
  return Eigen::Vector3d::Unit(static_cast<int>(direction));
}

inline void hold_ends(Case &settings)
{
  for (const int id : {0, 1})
  {
    fem::BoundaryCondition end;
    end.id = id;
    end.kind = fem::BoundaryKind::fixed;
    settings.body.boundary_conditions.push_back(end);
  }
}

/// Deviations of a random strip at rest from what the compliances of its parts say.
struct PatchErrors
{
  double strain = 0.; ///< of the particle region's mean strain, relative
  double energy = 0.; ///< excess of the body's energy, relative to the energy of the overlap
};

/// Mean displacement of the particles around a place [m], corrected for where they are.
inline double displacement_at(Body &body, double x, Direction direction, double strain)
{
  const Eigen::Matrix3Xd u = body.particle_displacements();
  const Eigen::Matrix3Xd &X = body.packing.positions;
  double sum = 0., n = 0.;
  for (int i = 0; i < X.cols(); ++i)
    if (std::abs(X(0, i) - x) < 2. * Strip::d)
    {
      sum += u(static_cast<int>(direction), i) - strain * (X(0, i) - x);
      n += 1.;
    }
  return sum / n;
}

constexpr double until_rest = 3.6e-4; ///< 20 passages of a P wave through 70 d [s]

/// Lets a strip come to rest that was strained but for its first cells, where the ends of the particles are held, and is held
/// at the other end, in a duration [s]. Returns its energy [J].
inline double energy_at_rest(Body &body, Direction direction, double elongation, double duration = until_rest)
{
  const double length = body.settings.body.mesh.upper[0], first = body.settings.body.mesh.cell_size;
  body.set_state([&](const Eigen::Vector3d &x)
                 { return Eigen::Vector3d(elongation * std::max(0., x[0] - first) / (length - first) * unit(direction)); },
                 [](const Eigen::Vector3d &) { return Eigen::Vector3d(Eigen::Vector3d::Zero()); });
  body.model.start();
  body.model.advance(static_cast<int>(duration / body.dt));
  const EnergyLedger energy = body.model.energies();
  EXPECT_LT(energy.kinetic, 1e-3 * energy.elastic);
  return energy.elastic + energy.coupling;
}

/// Force that bonds carry through planes between two places, mean over the planes [N].
inline double force_through(Body &body, double from, double to, Direction direction)
{
  constexpr int planes = 20;
  double sum = 0.;
  for (const dem::ActiveBond &bond : body.model.dem().bonds())
    for (int p = 0; p <= planes; ++p)
    {
      const double x = from + p * (to - from) / planes;
      if (std::min(bond.a[0], bond.b[0]) < x && std::max(bond.a[0], bond.b[0]) > x)
        sum += bond.force[static_cast<int>(direction)] * (bond.b[0] > bond.a[0] ? 1. : -1.) / (planes + 1);
    }
  MPI_Allreduce(MPI_IN_PLACE, &sum, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
  return sum;
}

/// Elongations of the parts of a strip for the force that goes through [m/N].
struct Flexibilities
{
  double region = 0., gauge = 0., overlap = 0.;
};
/// Where strains of the particle region are measured: clear of the held end and of the overlap [m].
inline double gauge_end(const Case &settings)
{
  return settings.fixed_region[0].upper[0] - 4. * Strip::d;
}
inline double elongation_of(const Case &settings)
{
  return 1e-5 * (settings.body.mesh.upper[0] - settings.body.mesh.cell_size);
}

/// Of a strip of particles alone, after a duration [s].
inline Flexibilities flexibilities(const Case &settings, const dem::Packing &packing, Direction direction,
                                   double duration = until_rest)
{
  const double region = settings.fixed_region[0].upper[0], gauge = gauge_end(settings);
  Body particles(settings, packing, Mode::dem);
  energy_at_rest(particles, direction, elongation_of(settings), duration);
  const double force = force_through(particles, 6. * Strip::d, gauge, direction);
  const double at_region = displacement_at(particles, region, direction, 1e-5);
  return {at_region / force, displacement_at(particles, gauge, direction, 1e-5) / force,
          (displacement_at(particles, region + settings.overlap.width, direction, 1e-5) - at_region) / force};
}

/// A packing is softer here and stiffer there, by some per cent. Run as particles alone, the strip tells the flexibility of its
/// parts. In the coupled strip cells with the rock's modulus take the place of the last part, and mix with the particles over
/// the overlap by the weights.
inline PatchErrors patch_errors(const Case &settings, const dem::Packing &packing, const Flexibilities &of, Direction direction,
                                double duration = until_rest)
{
  const fem::Material &rock = settings.body.material;
  const double modulus = direction == Direction::tension ? rock.lame_lambda() + 2. * rock.lame_mu() : rock.lame_mu();
  const double overlap = settings.overlap.width,
               cells = settings.body.mesh.upper[0] - settings.fixed_region[0].upper[0] - overlap;
  const double section = settings.body.mesh.upper[1] * (packing.dim == 3 ? settings.body.mesh.upper[2] : 1.);
  const double elongation = elongation_of(settings), of_rock = 1. / (modulus * section); // and metre

  Body coupled(settings, packing, Mode::fixed);
  const double energy = energy_at_rest(coupled, direction, elongation, duration);
  // Mean of 1/((1 - a) ratio + a) over the weights a.
  const double ratio = of_rock * overlap / of.overlap;
  const double mixed = of_rock * overlap * (std::abs(ratio - 1.) < 1e-6 ? 1. : std::log(ratio) / (ratio - 1.));
  const double expected_force = elongation / (of.region + mixed + of_rock * cells);
  PatchErrors errors;
  errors.strain = displacement_at(coupled, gauge_end(settings), direction, 1e-5) / (expected_force * of.gauge) - 1.;
  errors.energy = (energy - 0.5 * expected_force * elongation) / (0.5 * expected_force * expected_force * mixed);
  return errors;
}

/// Of a strip in two dimensions.
inline PatchErrors random_errors(const Case &method, int seed, Direction direction, int overlap_cells)
{
  Strip shape;
  shape.random = true;
  shape.seed = seed;
  shape.region = 8;
  shape.overlap = overlap_cells;
  shape.high = 5;
  StripCase strip(shape);
  strip.settings.constraint = method.constraint;
  strip.settings.constraint.fluctuation_relaxation = 0.05;
  strip.settings.local_damping = 0.4;
  hold_ends(strip.settings);
  return patch_errors(strip.settings, strip.packing, flexibilities(strip.settings, strip.packing, direction), direction);
}
} // namespace kerf::test
