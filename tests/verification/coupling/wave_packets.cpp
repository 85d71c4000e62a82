// SPDX-License-Identifier: GPL-2.0-or-later
// Wave packets run into the overlap of a lattice strip from either side: what comes back, what is lost.
#include "tests/support/plane_packet.h"

#include <gtest/gtest.h>

#include <iostream>

using namespace kerf;

namespace
{
Case multipliers(double relaxation)
{
  Case result;
  result.constraint.method = "multipliers";
  result.constraint.fluctuation_relaxation = relaxation;
  return result;
}

test::Passage pass(const Case &method, double length, int direction, bool from_particles)
{
  const test::Passage passage = test::pass(method, length, direction, from_particles);
  std::cout << "[ packet   ] " << (direction == 0 ? "P" : "S") << " of " << length << " d from the "
            << (from_particles ? "particles" : "finite elements") << ": returned " << passage.returned << ", lost "
            << 100. * passage.lost << " %" << std::endl;
  return passage;
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
      const test::Passage longer = pass(multipliers(0.02), 40., direction, from_particles);
      EXPECT_LT(longer.returned, 5e-5);
      EXPECT_LT(longer.lost, 0.005);
      const test::Passage shorter = pass(multipliers(0.02), 20., direction, from_particles);
      EXPECT_LT(shorter.returned, 5e-4);
      EXPECT_LT(shorter.lost, 0.03);
    }
}

// Waves of six diameters are no waves to cells of four: they may not come back either.
TEST(WavePackets, ShortWavesAreAbsorbed)
{
  for (const int direction : {0, 1})
    EXPECT_LT(pass(multipliers(0.1), 6., direction, true).returned, 0.1);
}

// A random packing scatters waves itself, much more than any interface. What the overlap adds of waves of 20 d, against a run
// of particles alone: at most 2 % of a P packet, 3 % of an S packet.
TEST(WavePackets, RandomPackingSendsLittleBack)
{
  for (const int direction : {0, 1})
  {
    double scattered = 0.;
    const double returned = test::sent_back(multipliers(0.05), 1, 20., direction, scattered);
    std::cout << "[ packet   ] " << (direction == 0 ? "P" : "S") << " of 20 d in a random packing: the overlap sends back "
              << returned << ", the packing itself " << scattered << std::endl;
    EXPECT_LT(returned, direction == 0 ? 0.02 : 0.03);
  }
}
