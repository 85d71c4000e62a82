// SPDX-License-Identifier: GPL-2.0-or-later
// Wave packets run into the overlap of a lattice strip from either side: what comes back, what is lost.
#include "tests/unit/plane_packet.h"

#include <gtest/gtest.h>

using namespace kerf;
using test::Body;
using test::PlanePacket;
using test::Strip;
using test::StripCase;

namespace
{
/// Energies relative to that of the packet.
struct Passage
{
  double returned = 0., lost = 0.;
};

/// @param length of the waves in diameters. The packet starts four lengths from the overlap and the run ends when what comes
/// back and what goes through have both left it.
Passage pass(const Case &method, double length, int direction, bool from_particles)
{
  Strip shape;
  const double wave = length * Strip::d;
  shape.region = shape.fem = static_cast<int>(std::ceil(8.5 * wave / shape.cell_length()));
  StripCase strip(shape);
  strip.settings.constraint = method.constraint;
  strip.settings.penalty_ratio = method.penalty_ratio;
  strip.settings.fluctuation_relaxation = method.fluctuation_relaxation;
  Body body(strip.settings, strip.packing, Mode::fixed);
  const double amplitude = 1e-6 * Strip::d;
  double speed = 0.; // of the energy
  if (from_particles)
  {
    const auto at = [&](double k) { return test::lattice_wave(strip, k, direction); };
    body.model.start();
    put_on_particles(body, PlanePacket(shape.region_end() - 4. * wave, wave, 1, amplitude, at), direction);
    const double k = 2. * M_PI / wave;
    speed = (at(1.01 * k).omega - at(0.99 * k).omega) / (0.02 * k);
  }
  else
  {
    const auto at = [&](double k) { return test::cells_wave(strip.settings, k, direction); };
    const double centre = shape.region_end() + shape.overlap_width() + 4. * wave;
    put_on_nodes(body, PlanePacket(centre, wave, -1, amplitude, at), direction);
    body.model.start();
    const double k = 2. * M_PI / wave;
    speed = (at(1.01 * k).omega - at(0.99 * k).omega) / (0.02 * k);
  }
  const double before = body.model.energies().held();
  body.model.advance(static_cast<int>((8. * wave + shape.overlap_width()) / (speed * body.dt)));
  const EnergyLedger energy = body.model.energies();
  const fem::Energies fem = body.fem->energies();
  const dem::Energies dem = body.model.dem().energies();
  Passage result;
  result.returned = from_particles ? (dem.kinetic + dem.elastic) / before : (fem.kinetic + fem.elastic) / before;
  result.lost = 1. - energy.held() / before;
  std::cout << "[ packet   ] " << (direction == 0 ? "P" : "S") << " of " << length << " d from the "
            << (from_particles ? "particles" : "finite elements") << ": returned " << result.returned << ", lost "
            << 100. * result.lost << " %" << std::endl;
  return result;
}

Case multipliers(double relaxation)
{
  Case result;
  result.constraint = ConstraintMethod::multipliers;
  result.fluctuation_relaxation = relaxation;
  return result;
}
} // namespace

// An overlap of 17 d and cells of 4.3 d. What comes back of resolved waves is the difference of dispersion between lattice and
// cells, which falls with the fourth power of the wave's length; what is lost, the relaxation of the part of a wave that cells
// cannot follow.
TEST(WavePackets, PassTheOverlap)
{
  for (const bool from_particles : {true, false})
    for (const int direction : {0, 1})
    {
      const Passage longer = pass(multipliers(0.02), 40., direction, from_particles);
      EXPECT_LT(longer.returned, 5e-5);
      EXPECT_LT(longer.lost, 0.005);
      const Passage shorter = pass(multipliers(0.02), 20., direction, from_particles);
      EXPECT_LT(shorter.returned, 5e-4);
      EXPECT_LT(shorter.lost, 0.03);
    }
}

// Waves of six diameters are no waves to cells of four: they may not come back either.
TEST(WavePackets, ShortWavesAreAbsorbed)
{
  for (const int direction : {0, 1})
    EXPECT_LT(pass(multipliers(0.05), 6., direction, true).returned, 0.1);
}
