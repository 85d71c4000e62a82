// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/script/script_force.h"

#include <cstdint>
#include <fix.h>
#include <lammps.h>
#include <map>
#include <memory>
#include <string>
#include <vector>

/// A LIGGGHTS for stand-alone scripts with the fixes that these need beside those of LIGGGHTS.
namespace kerf::dem
{
/// Knows the external forces that its script may name.
class ScriptLiggghts : public LAMMPS_NS::LAMMPS
{
public:
  ScriptLiggghts(int argc, char **argv, MPI_Comm comm, const std::map<std::string, ScriptForceMaker> &forces)
    : LAMMPS(argc, argv, comm), forces(forces)
  {
  }
  const std::map<std::string, ScriptForceMaker> forces; ///< by style of their fix
};

/// With the arguments of LIGGGHTS' own program; argv[0] is not read. The fixes below are among its styles.
std::unique_ptr<ScriptLiggghts> make_script_liggghts(int argc, char **argv, MPI_Comm comm,
                                                     const std::map<std::string, ScriptForceMaker> &forces);

/// Made by the pair style itself under the name rock_bond: local damping after all fixes that change forces, and energies for
/// output. f_rock_bond[1..7]: kinetic, elastic, damping, friction, released energy [J], intact bonds, broken bonds.
class RockBondFix : public LAMMPS_NS::Fix
{
public:
  RockBondFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words);

  int setmask() override;
  void setup(int) override;
  void pre_initial_integrate() override;
  void pre_final_integrate() override;
  double compute_vector(int component) override;

private:
  bool damp_setup = false; // the forces of the setup do not include local damping yet
  std::int64_t step_of_values = -1;
  std::vector<double> values;
};

/// A ScriptForce as a fix. Only a ScriptLiggghts makes it.
class ScriptForceFix : public LAMMPS_NS::Fix
{
public:
  ScriptForceFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words);

  int setmask() override;
  void setup(int) override;
  void post_force(int) override;
  double compute_vector(int component) override;

private:
  void apply(Phase phase);
  Particles particles();

  std::unique_ptr<ScriptForce> force;
  std::uint64_t order = 0;
  std::vector<int> index;      // of a script without the rock bond
  std::vector<double> weights; // of a script without the rock bond
  std::int64_t step_of_values = -1;
  std::vector<double> values;
};
} // namespace kerf::dem
