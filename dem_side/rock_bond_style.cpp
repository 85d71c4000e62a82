// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/rock_bond_style.h"

#include "dem_side/rock_bond_loop.h"

// contact_models.h uses what the first one declares.
#include <comm.h>

#include <atom.h>
#include <contact_models.h>
#include <domain.h>
#include <fix_property_atom.h>
#include <input.h>
#include <modify.h>
#include <neighbor.h>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
namespace
{
constexpr const char *model_name = "kerf_rock_bond";
constexpr int model_id = 42; // of the normal models; LIGGGHTS' own end at 9, six bits are there

// LIGGGHTS makes the style itself, out of an input line that cannot carry these.
const RockBondParameters *parameters_to_install = nullptr;
RockBondStyle *installed = nullptr;

LAMMPS_NS::FixPropertyAtom *find_property(LAMMPS_NS::LAMMPS &lmp, const char *name)
{
  auto *property = dynamic_cast<LAMMPS_NS::FixPropertyAtom *>(lmp.modify->fix[lmp.modify->find_fix(name)]);
  property->just_created = 0; // else the first setup would overwrite the values of inserted particles with the default
  return property;
}
} // namespace

RockBondStyle *RockBondStyle::install(LAMMPS_NS::LAMMPS &lmp, const RockBondParameters &parameters)
{
  static const bool registered = []
  {
    auto &models = LIGGGHTS::ContactModels::Factory::instance();
    models.addNormalModel(model_name, model_id);
    const std::int64_t hash = LIGGGHTS::Utils::generate_gran_hashcode(
      model_id, LIGGGHTS::ContactModels::TANGENTIAL_OFF, LIGGGHTS::ContactModels::COHESION_OFF,
      LIGGGHTS::ContactModels::ROLLING_OFF, LIGGGHTS::ContactModels::SURFACE_DEFAULT);
    LIGGGHTS::PairStyles::Factory::instance().addStyle("gran", static_cast<int>(hash), &RockBondStyle::create);
    return true;
  }();
  (void)registered;

  // Moved with the particles; the first two reach ghosts, too (refresh_ghosts()).
  lmp.input->one("fix rotation all property/atom rotation vector no yes no 1. 0. 0. 0.");
  lmp.input->one("fix weight all property/atom weight scalar no yes no 1.");
  lmp.input->one("fix broken all property/atom broken scalar no no no 0.");
  parameters_to_install = &parameters;
  lmp.input->one((std::string("pair_style gran model ") + model_name).c_str());
  lmp.input->one("pair_coeff * *");
  parameters_to_install = nullptr;
  return installed;
}

LIGGGHTS::PairStyles::IGranularPairStyle *RockBondStyle::create(LAMMPS_NS::LAMMPS *lmp, LAMMPS_NS::PairGran *gran,
                                                                std::int64_t hash)
{
  if (lmp->domain->dimension == 2)
    installed = new RockBondLoop<2>(*lmp, *gran, hash, *parameters_to_install);
  else
    installed = new RockBondLoop<3>(*lmp, *gran, hash, *parameters_to_install);
  return installed;
}

RockBondStyle::RockBondStyle(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash,
                             const RockBondParameters &parameters)
  : lmp(lmp), gran(gran), hash(hash), parameters(parameters), rotations(find_property(lmp, "rotation")),
    weights(find_property(lmp, "weight")), broken_counts(find_property(lmp, "broken"))
{
}

void RockBondStyle::settings(int, char **, LIGGGHTS::IContactHistorySetup *history)
{
  history->add_history_value("state", "0");
  history->add_history_value("rest_length", "0");
  for (const char *component : {"x", "y", "z"})
    history->add_history_value(component, "1");
}

double *RockBondStyle::rotation() const
{
  return rotations->array_atom ? rotations->array_atom[0] : nullptr;
}
const double *RockBondStyle::weight() const
{
  return weights->vector_atom;
}
void RockBondStyle::set_weight(int local, double weight)
{
  weights->vector_atom[local] = weight;
}
double RockBondStyle::broken_count(int local) const
{
  return broken_counts->vector_atom[local];
}

void RockBondStyle::initialise(int local, double weight, const Eigen::Quaterniond &rotation)
{
  set_weight(local, weight);
  double *q = rotations->array_atom[local];
  q[0] = rotation.w(), q[1] = rotation.x(), q[2] = rotation.y(), q[3] = rotation.z();
}

Particles RockBondStyle::particles()
{
  Particles p;
  p.order = order;
  p.n = lmp.atom->nlocal;
  if (p.n == 0)
    return p;
  const auto map = [&p](Vectors &vectors, double **array) { new (&vectors) Vectors(array[0], 3, p.n); };
  map(p.position, lmp.atom->x);
  map(p.velocity, lmp.atom->v);
  map(p.angular_velocity, lmp.atom->omega);
  map(p.force, lmp.atom->f);
  map(p.torque, lmp.atom->torque);
  p.index = index.data();
  p.mass = lmp.atom->rmass;
  p.radius = lmp.atom->radius;
  p.weight = weight();
  p.rotation = rotation();
  return p;
}

void RockBondStyle::compute_force(LAMMPS_NS::PairGran *, int, int, int)
{
  gran.evflag = gran.vflag_fdotr = 0;
  const bool step = !lmp.update->setupflag;
  if (lmp.neighbor->ago == 0)
    refresh_ghosts();
  if (step)
    ++steps;
  if (!fresh.empty())
    create_bonds();

  pair_forces(step);
  if (hook && *hook)
  {
    Particles local = particles();
    (*hook)(step ? Phase::step : Phase::setup, local);
  }
  damp(step);
}

/// After particles changed rank or place: what LIGGGHTS does not send to the ghosts by itself. In between, every rank turns
/// its ghosts with the angular velocities that LIGGGHTS sends in each step.
void RockBondStyle::refresh_ghosts()
{
  check_intact_bonds();
  rotations->do_forward_comm();
  weights->do_forward_comm();
  const int *tag = lmp.atom->tag;
  index.resize(lmp.atom->nlocal);
  for (int i = 0; i < lmp.atom->nlocal; ++i)
    index[i] = tag[i] - 1;
  ++order;
}

/// LIGGGHTS silently forgets a bond that has outgrown the lists when it builds them.
void RockBondStyle::check_intact_bonds()
{
  std::int64_t sums[] = {intact_bond_ends(), bond_ends_failed, overstretched};
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_INT64_T, MPI_SUM, lmp.world);
  const bool lost = sums[0] + sums[1] != bond_ends_at_build;
  const bool explained = lmp.atom->natoms != n_particles; // particles took their bonds out of the domain
  if (sums[2] > 0 || (lost && !explained))
    throw std::runtime_error("intact bonds were stretched far beyond their strength: the particles are unstable, the time step "
                             "is probably too large");
  bond_ends_at_build = sums[0];
  bond_ends_failed = 0;
  n_particles = lmp.atom->natoms;
}

void RockBondStyle::create_bonds()
{
  std::int64_t made = 0;
  const int *tag = lmp.atom->tag;
  const int n_local = lmp.atom->nlocal;
  const Packing &packing = *parameters.packing;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      const int a = tag[i] - 1, b = tag[j] - 1;
      if (!(fresh[a] || fresh[b]) || !parameters.stored_bonds->bonded(a, b))
        return;
      const Eigen::Vector3d stored = packing.positions.col(b) - packing.positions.col(a);
      history.state = PairHistory::intact;
      history.rest_length = stored.norm();
      Eigen::Map<Eigen::Vector3d>(history.vector) = stored / history.rest_length;
      flag = 1;
      made += j < n_local ? 2 : 1;
    });
  fresh.clear();
  MPI_Allreduce(&made, &bond_ends_made, 1, MPI_INT64_T, MPI_SUM, lmp.world);
  bond_ends_at_build += bond_ends_made;
}

void RockBondStyle::record_break(int i, int j, bool shear, const Eigen::Vector3d &position)
{
  const int *tag = lmp.atom->tag;
  const bool inside = j < lmp.atom->nlocal;
  broken_counts->vector_atom[i] += 1.;
  bond_ends_failed += inside ? 2 : 1;
  if (inside)
    broken_counts->vector_atom[j] += 1.;
  if (inside || tag[i] < tag[j])
    broken.push_back({steps, std::min(tag[i], tag[j]) - 1, std::max(tag[i], tag[j]) - 1, shear, position});
}

std::int64_t RockBondStyle::intact_bond_ends() const
{
  std::int64_t ends = 0;
  const int n_local = lmp.atom->nlocal;
  for_each_pair(
    [&](int, int j, const PairHistory &history, int)
    {
      if (history.state == PairHistory::intact)
        ends += j < n_local ? 2 : 1;
    });
  return ends;
}
} // namespace kerf::dem
