// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/script/stand_alone.h"

#include <fix.h>
#include <lammps.h>

/// Fixes that stand-alone scripts need beside those of LIGGGHTS.
namespace kerf::dem
{
/// Made by the pair style itself, named rock_bond: local damping after all fixes that change forces, and energies for output.
/// f_rock_bond[1..7]: kinetic, elastic, damping, friction, released energy [J], intact bonds, broken bonds.
class RockBondFix : public LAMMPS_NS::Fix
{
public:
  RockBondFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words);
  static void register_with(LAMMPS_NS::LAMMPS &lmp);

  int setmask() override;
  void setup(int) override;
  void pre_initial_integrate() override;
  void pre_final_integrate() override;
  double compute_vector(int component) override;

private:
  bool damp_setup = false; // forces of the setup still lack local damping
  std::int64_t step_of_values = -1;
  std::vector<double> values;
};

/// A ScriptForce as fix.
class ScriptForceFix : public LAMMPS_NS::Fix
{
public:
  ScriptForceFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words);
  static void register_with(LAMMPS_NS::LAMMPS &lmp, const std::map<std::string, ScriptForceMaker> &forces);

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
  std::vector<double> weights; // likewise
  std::int64_t step_of_values = -1;
  std::vector<double> values;
};
} // namespace kerf::dem
