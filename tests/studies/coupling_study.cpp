// SPDX-License-Identifier: GPL-2.0-or-later
// Numbers of docs/results/coupling.md, as CSV on the standard output: coupling_study patch|front|waves|random_waves [METHOD].
// Minutes each.
#include "tests/support/plane_packet.h"
#include "tests/support/strip_front.h"

#include <algorithm>
#include <iostream>
#include <map>
#include <string>

using namespace kerf;
using test::Direction;
using test::Strip;
using test::StripCase;

namespace
{
struct Method
{
  const char *name;
  std::string constraint;
  double ratio, relaxation;
  bool corrector = false;
};
std::vector<Method> methods = {{"penalty, 0.1 k_n", "penalty", 0.1, 0.},
                               {"penalty, 1 k_n", "penalty", 1., 0.},
                               {"penalty, 4 k_n", "penalty", 4., 0.},
                               {"penalty, 1 k_n, corrector", "penalty", 1., 0., true},
                               {"penalty_mass_scaled, 0.25", "penalty_mass_scaled", 0.25, 0.},
                               {"penalty_mass_scaled, 1", "penalty_mass_scaled", 1., 0.},
                               {"penalty_mass_scaled, 0.5, corrector", "penalty_mass_scaled", 0.5, 0., true},
                               {"multipliers", "multipliers", 0., 0.},
                               {"multipliers, relaxation 0.02", "multipliers", 0., 0.02},
                               {"multipliers, relaxation 0.05", "multipliers", 0., 0.05},
                               {"multipliers_diagonal, 0.02", "multipliers_diagonal", 0.02, 0.}};
constexpr int seeds[] = {1, 2};
const std::pair<Direction, const char *> directions[] = {{Direction::tension, "tension"}, {Direction::shear, "shear"}};

Case settings_of(const Method &method)
{
  Case result;
  result.constraint.method = method.constraint;
  result.constraint.penalty_ratio = method.ratio;
  result.constraint.corrector = method.corrector;
  result.constraint.fluctuation_relaxation = method.relaxation;
  return result;
}

void patch()
{
  std::cout << "method,overlap,seed,direction,strain,energy\n";
  for (const Method &method : methods)
    if (method.constraint != "multipliers" || method.relaxation == 0.05) // the relaxation does nothing at rest
      for (const int cells : {2, 4})
        for (const int seed : seeds)
          for (const auto &[direction, name] : directions)
          {
            const test::PatchErrors errors = test::random_errors(settings_of(method), seed, direction, cells);
            std::cout << '"' << method.name << "\"," << 4 * cells << ',' << seed << ',' << name << ',' << errors.strain << ','
                      << errors.energy << std::endl;
          }
}

void front()
{
  std::cout << "method,cells,seed,direction,conversion,kinetic,noise,broken\n";
  for (const Method &method : methods)
    for (const int cells : {1, 2, 4})
      for (const int seed : seeds)
        for (const auto &[direction, name] : directions)
        {
          Strip shape;
          shape.random = true;
          shape.seed = seed;
          shape.fem = 8;
          shape.high = 5;
          StripCase strip(shape);
          strip.settings.constraint.method = method.constraint;
          strip.settings.constraint.penalty_ratio = method.ratio;
          strip.settings.constraint.corrector = method.corrector;
          strip.settings.constraint.fluctuation_relaxation = method.relaxation;
          const test::FrontChange change = test::move_random_front(strip, direction, cells, 1e-5);
          std::cout << '"' << method.name << "\"," << cells << ',' << seed << ',' << name << ',' << change.conversion << ','
                    << change.kinetic << ',' << change.noise << ',' << change.broken << std::endl;
        }
}

void waves()
{
  std::cout << "method,length,wave,from,returned,lost\n";
  for (const Method &method : methods)
    for (const double length : {40., 20., 10., 6.})
      for (const int direction : {0, 1})
        for (const bool from_particles : {true, false})
          if (from_particles || length >= 20.) // shorter ones do not exist in the cells
          {
            const test::Passage passage = test::pass(settings_of(method), length, direction, from_particles);
            std::cout << '"' << method.name << "\"," << length << ',' << (direction == 0 ? 'P' : 'S') << ','
                      << (from_particles ? "particles" : "cells") << ',' << passage.returned << ',' << passage.lost
                      << std::endl;
          }
}

void random_waves()
{
  std::cout << "method,length,wave,seed,returned,scattered\n";
  for (std::size_t m = 0; m < methods.size(); ++m) // one of each kind
    if (methods.size() == 1 || m == 1 || m == 3 || m == 5 || m == 9 || m == 10)
      for (const double length : {20.})
        for (const int direction : {0, 1})
          for (const int seed : seeds)
          {
            const Method &method = methods[m];
            double scattered = 0.;
            const double returned = test::sent_back(settings_of(method), seed, length, direction, scattered);
            std::cout << '"' << method.name << "\"," << length << ',' << (direction == 0 ? 'P' : 'S') << ',' << seed << ','
                      << returned << ',' << scattered << std::endl;
          }
}
} // namespace

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  const std::map<std::string, void (*)()> studies = {
    {"patch", patch}, {"front", front}, {"waves", waves}, {"random_waves", random_waves}};
  const auto study = studies.find(argc > 1 ? argv[1] : "");
  // Only the methods of this name; the study of random packings takes some of all.
  if (const std::string name = argc > 2 ? argv[2] : ""; !name.empty())
    methods.erase(std::remove_if(methods.begin(), methods.end(), [&](const Method &method) { return name != method.name; }),
                  methods.end());
  if (study != studies.end())
    study->second();
  else
    std::cerr << "usage: coupling_study patch|front|waves|random_waves [METHOD]" << std::endl;
  MPI_Finalize();
  return study != studies.end() ? 0 : 2;
}
