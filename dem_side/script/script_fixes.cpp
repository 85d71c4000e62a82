// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/script/script_fixes.h"

#include "dem_side/engine/fix_styles.h"
#include "dem_side/engine/install_rock_bond.h"
#include "dem_side/engine/liggghts_instance.h"

#include <atom.h>
#include <modify.h>
#include <neighbor.h>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
std::unique_ptr<ScriptLiggghts> make_script_liggghts(int argc, char **argv, MPI_Comm comm,
                                                     const std::map<std::string, ScriptForceMaker> &forces)
{
  const StyleWarningsOff quiet;
  auto lmp = std::make_unique<ScriptLiggghts>(argc, argv, comm, forces);
  register_fix(*lmp, "kerf/rock_bond", &make_fix<RockBondFix>);
  for (const auto &[style, maker] : forces)
    register_fix(*lmp, style, &make_fix<ScriptForceFix>);
  return lmp;
}

RockBondFix::RockBondFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words) : Fix(lmp, n_words, words)
{
  vector_flag = 1;
  size_vector = 7;
  global_freq = 1;
  extvector = 1;
}

int RockBondFix::setmask()
{
  return LAMMPS_NS::FixConst::PRE_INITIAL_INTEGRATE | LAMMPS_NS::FixConst::PRE_FINAL_INTEGRATE;
}

void RockBondFix::setup(int)
{
  damp_setup = true; // other fixes may still change the forces of the setup
  step_of_values = -1;
}

void RockBondFix::pre_initial_integrate()
{
  if (damp_setup)
    if (RockBondStyle *style = find_rock_bond(*lmp))
      style->damp_all(false);
  damp_setup = false;
}

void RockBondFix::pre_final_integrate()
{
  if (RockBondStyle *style = find_rock_bond(*lmp))
    style->damp_all(true);
}

double RockBondFix::compute_vector(int component)
{
  RockBondStyle *style = find_rock_bond(*lmp);
  if (style == nullptr)
    return 0.;
  if (step_of_values != update->ntimestep)
  {
    const Energies e = style->energies();
    std::int64_t bonds[] = {style->intact_bond_ends(), static_cast<std::int64_t>(style->broken.size())};
    MPI_Allreduce(MPI_IN_PLACE, bonds, 2, MPI_INT64_T, MPI_SUM, world);
    values = {e.kinetic,
              e.elastic,
              e.damping,
              e.friction,
              e.released,
              static_cast<double>(bonds[0] / 2),
              static_cast<double>(bonds[1])};
    step_of_values = update->ntimestep;
  }
  return values[component];
}

ScriptForceFix::ScriptForceFix(LAMMPS_NS::LAMMPS *lmp, int n_words, char **words) : Fix(lmp, n_words, words)
{
  try
  {
    force =
      static_cast<const ScriptLiggghts *>(lmp)->forces.at(style)(std::vector<std::string>(words + 3, words + n_words), world);
  }
  catch (const std::exception &error)
  {
    throw std::invalid_argument(std::string("fix ") + id + " all " + style + ": " + error.what());
  }
  if (force->n_values() > 0)
  {
    vector_flag = 1;
    size_vector = force->n_values();
    global_freq = 1;
    extvector = 1;
  }
}

int ScriptForceFix::setmask()
{
  return LAMMPS_NS::FixConst::POST_FORCE;
}

Particles ScriptForceFix::particles()
{
  if (neighbor->ago == 0)
    ++order;
  if (RockBondStyle *style = find_rock_bond(*lmp))
    return style->particles();
  Particles all;
  all.order = order;
  if (atom->nlocal > 0)
  {
    all.n = atom->nlocal;
    const auto map = [&all](Vectors &vectors, double **array) { new (&vectors) Vectors(array[0], 3, all.n); };
    map(all.position, atom->x);
    map(all.velocity, atom->v);
    map(all.angular_velocity, atom->omega);
    map(all.force, atom->f);
    map(all.torque, atom->torque);
    index.resize(all.n);
    for (int i = 0; i < all.n; ++i)
      index[i] = atom->tag[i] - 1;
    weights.assign(all.n, 1.);
    all.index = index.data();
    all.weight = weights.data();
    all.mass = atom->rmass;
    all.radius = atom->radius;
  }
  return all;
}

void ScriptForceFix::apply(Phase phase)
{
  Particles all = particles();
  if (groupbit == 1) // group all
  {
    force->apply(phase, all, update->get_cur_time(), update->dt);
    return;
  }
  // The force also acted on particles outside of the group: restore theirs.
  const int n = all.n;
  const Eigen::Matrix3Xd forces = n > 0 ? Eigen::Matrix3Xd(all.force) : Eigen::Matrix3Xd(3, 0);
  const Eigen::Matrix3Xd torques = n > 0 ? Eigen::Matrix3Xd(all.torque) : Eigen::Matrix3Xd(3, 0);
  force->apply(phase, all, update->get_cur_time(), update->dt);
  for (int i = 0; i < n; ++i)
    if (!(atom->mask[i] & groupbit))
    {
      all.force.col(i) = forces.col(i);
      all.torque.col(i) = torques.col(i);
    }
}

void ScriptForceFix::setup(int)
{
  step_of_values = -1;
  apply(Phase::setup);
}

void ScriptForceFix::post_force(int)
{
  apply(Phase::step);
}

double ScriptForceFix::compute_vector(int component)
{
  if (step_of_values != update->ntimestep)
  {
    values = force->values();
    step_of_values = update->ntimestep;
  }
  return values[component];
}
} // namespace kerf::dem
