// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond_network/bond_network.h"
#include "tests/support/coupled_body.h"

/// Strips that repeat themselves across y: particles on the left, an overlap, finite elements on the right.
namespace kerf::test
{
struct Strip
{
  bool random = false;                             ///< a random packing; else a triangular lattice with columns x = const
  int seed = 1;                                    ///< of the random packing
  int region = 10, overlap = 4, fem = 6, high = 2; ///< cells
  int cell = 0;                                    ///< length of cells in columns of the lattice or in diameters; 0: five, four

  static constexpr double d = 1e-3; ///< mean diameter or spacing [m]
  /// Overlap and particle region of a lattice end at columns.
  double cell_length() const { return random ? (cell > 0 ? cell : 4) * d : (cell > 0 ? cell : 5) * 0.5 * std::sqrt(3.) * d; }
  double region_end() const { return region * cell_length(); }
  double overlap_width() const { return overlap * cell_length(); }
  double length() const { return (region + overlap + fem) * cell_length(); }
  double height() const { return high * 4. * d; }
};

/// A case and its store with the stiffnesses that give the rock's moduli.
struct StripCase
{
  explicit StripCase(const Strip &strip) : strip(strip), settings(lattice_rock(Strip::d))
  {
    settings.mesh.upper = Eigen::Vector3d(strip.length(), strip.height(), 0.);
    settings.mesh.cell_size = strip.cell_length();
    settings.mesh.periodic = {{false, true, false}};
    settings.packing.upper = settings.mesh.upper;
    settings.packing.periodic = settings.mesh.periodic;
    settings.overlap.width = strip.overlap_width();
    settings.constraint.fluctuation_relaxation = 0.05;
    const double d = Strip::d;
    settings.fixed_region.push_back(
      {Eigen::Vector3d(0., -d, -1.), Eigen::Vector3d(strip.region_end(), strip.height() + d, 1.)});
    if (!strip.random)
    {
      settings.packing.lattice = {1, 0.};
      packing = dem::generate_packing(settings.packing);
      return;
    }
    settings.packing.kind = "random";
    settings.packing.radius_spread = 0.4;
    settings.packing.seed = strip.seed;
    settings.activation.relaxation_steps = 15;
    packing = dem::generate_packing(settings.packing);
    const dem::ElasticCalibration bonds = dem::calibrate_elastic(packing, settings.rock.young, settings.rock.poisson);
    settings.bond.k_n = bonds.k_n;
    settings.bond.k_t = bonds.k_t;
  }

  Strip strip;
  Case settings;
  dem::Packing packing;
};

/// Slope over x of a component of the particles' displacement between two places [m], least squares.
inline double slope(Body &body, int component, double from, double to)
{
  const Eigen::Matrix3Xd u = body.particle_displacements();
  const Eigen::Matrix3Xd &X = body.packing.positions;
  double n = 0., x = 0., y = 0., xx = 0., xy = 0.;
  for (int i = 0; i < X.cols(); ++i)
    if (X(0, i) > from && X(0, i) < to)
    {
      n += 1.;
      x += X(0, i) - from;
      y += u(component, i);
      xx += (X(0, i) - from) * (X(0, i) - from);
      xy += (X(0, i) - from) * u(component, i);
    }
  return (n * xy - x * y) / (n * xx - x * x);
}
} // namespace kerf::test
