// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rock_bond_style.h"

#include "dem_side/engine/rock_bond_loop.h"
#include "dem_side/script/script_fixes.h"

// contact_models.h uses what the first one declares.
#include <comm.h>

#include <atom.h>
#include <contact_models.h>
#include <domain.h>
#include <fix_property_atom.h>
#include <force.h>
#include <input.h>
#include <iterator>
#include <modify.h>
#include <neighbor.h>
#include <sstream>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
namespace
{
constexpr const char *model_name = "kerf_rock_bond";
constexpr int model_id = 42; // of the normal models; LIGGGHTS' own end at 9, six bits are there

// LIGGGHTS makes the style itself, out of an input line that cannot carry these; nullptr when a script names the style.
const RockBondParameters *parameters_to_install = nullptr;
RockBondStyle *installed = nullptr;

/// Not an input line, which would overwrite the words of the one that is being read.
void add_fix(LAMMPS_NS::LAMMPS &lmp, const std::string &line)
{
  std::istringstream stream(line);
  std::vector<std::string> words{std::istream_iterator<std::string>(stream), {}};
  std::vector<char *> pointers;
  for (std::string &word : words)
    pointers.push_back(word.data());
  lmp.modify->add_fix(static_cast<int>(pointers.size()), pointers.data());
}

LAMMPS_NS::FixPropertyAtom *find_property(LAMMPS_NS::LAMMPS &lmp, const char *name)
{
  auto *property = dynamic_cast<LAMMPS_NS::FixPropertyAtom *>(lmp.modify->fix[lmp.modify->find_fix(name)]);
  property->just_created = 0; // else the first setup would overwrite the values of inserted particles with the default
  return property;
}
} // namespace

void RockBondStyle::register_with(LAMMPS_NS::LAMMPS &lmp)
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
  RockBondFix::register_with(lmp);
}

RockBondStyle *RockBondStyle::install(LAMMPS_NS::LAMMPS &lmp, const RockBondParameters &parameters)
{
  register_with(lmp);
  parameters_to_install = &parameters;
  lmp.input->one((std::string("pair_style gran model ") + model_name).c_str());
  lmp.input->one("pair_coeff * *");
  parameters_to_install = nullptr;
  return installed;
}

RockBondStyle *RockBondStyle::of(LAMMPS_NS::LAMMPS &lmp)
{
  // The pair style hides the model it runs; a script can only have one.
  const auto *gran = dynamic_cast<LAMMPS_NS::PairGran *>(lmp.force->pair);
  return gran != nullptr && installed != nullptr && &installed->gran == gran ? installed : nullptr;
}

LIGGGHTS::PairStyles::IGranularPairStyle *RockBondStyle::create(LAMMPS_NS::LAMMPS *lmp, LAMMPS_NS::PairGran *gran,
                                                                std::int64_t hash)
{
  if (lmp->domain->box_exist == 0)
    throw std::invalid_argument("pair_style gran model kerf_rock_bond must come after the box (read_data or create_box)");
  // Moved with the particles; the first two reach ghosts, too (refresh_ghosts()).
  if (lmp->modify->find_fix("kerf_rotation") < 0)
  {
    add_fix(*lmp, "kerf_rotation all property/atom kerf_rotation vector no yes no 1. 0. 0. 0.");
    add_fix(*lmp, "kerf_weight all property/atom kerf_weight scalar no yes no 1.");
    add_fix(*lmp, "kerf_broken all property/atom kerf_broken scalar no no no 0.");
    if (parameters_to_install == nullptr)
      add_fix(*lmp, "rock_bond all kerf/rock_bond");
  }
  const RockBondParameters of_script;
  const RockBondParameters &parameters = parameters_to_install != nullptr ? *parameters_to_install : of_script;
  if (lmp->domain->dimension == 2)
    installed = new RockBondLoop<2>(*lmp, *gran, hash, parameters);
  else
    installed = new RockBondLoop<3>(*lmp, *gran, hash, parameters);
  return installed;
}

RockBondStyle::RockBondStyle(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash,
                             const RockBondParameters &parameters)
  : lmp(lmp), gran(gran), hash(hash), parameters(parameters), rotations(find_property(lmp, "kerf_rotation")),
    weights(find_property(lmp, "kerf_weight")), broken_counts(find_property(lmp, "kerf_broken"))
{
}

RockBondStyle::~RockBondStyle()
{
  if (installed == this)
    installed = nullptr;
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

void RockBondStyle::send_to_ghosts()
{
  rotations->do_forward_comm();
  weights->do_forward_comm();
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
  if (!added.empty())
  {
    create_bonds();
    if (own_store != nullptr)
      check_bonds_of_script();
  }

  pair_forces(step);
  if (hook && *hook)
  {
    Particles local = particles();
    (*hook)(step ? Phase::step : Phase::setup, local);
  }
  if (own_store == nullptr)
    damp_all(step);
}

void RockBondStyle::damp_all(bool step)
{
  const double before = dissipation.damping;
  damp(step);
  if (step)
    damping_ahead = 0.5 * (dissipation.damping - before);
}

/// After particles changed rank or place: what LIGGGHTS does not send to the ghosts by itself. In between, every rank turns
/// its ghosts with the angular velocities that LIGGGHTS sends in each step.
void RockBondStyle::refresh_ghosts()
{
  check_intact_bonds();
  send_to_ghosts();
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
      if (std::max(a, b) >= packing.size() || !(added[a] || added[b]) || !parameters.stored_bonds->bonded(a, b))
        return;
      const Eigen::Vector3d stored = packing.branch(a, b);
      history.state = PairHistory::intact;
      history.rest_length = stored.norm();
      Eigen::Map<Eigen::Vector3d>(history.vector) = stored / history.rest_length;
      flag = 1;
      made += j < n_local ? 2 : 1;
    });
  added.clear();
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

Energies RockBondStyle::energies()
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const double inertia_factor = lmp.domain->dimension == 2 ? 0.5 : 0.4; // of a disc, a sphere: J = factor m r^2
  const auto square = [](const double *v) { return Eigen::Map<const Eigen::Vector3d>(v).squaredNorm(); };
  Energies sum;
  for (int i = 0; i < atom.nlocal; ++i)
  {
    const double mass = atom.rmass[i], inertia = inertia_factor * mass * atom.radius[i] * atom.radius[i];
    sum.kinetic += 0.5 * (mass * square(atom.v[i]) + inertia * square(atom.omega[i]));
    sum.finite_step += square(atom.f[i]) / mass + square(atom.torque[i]) / inertia;
  }
  sum.finite_step *= -parameters.time_step * parameters.time_step / 8.;
  sum.elastic = lmp.atom->natoms > 0 ? elastic_energy() : 0.;
  sum.damping = dissipation.damping - damping_ahead;
  sum.friction = dissipation.friction;
  sum.released = dissipation.released;
  static_assert(sizeof(Energies) == 6 * sizeof(double));
  MPI_Allreduce(MPI_IN_PLACE, &sum, 6, MPI_DOUBLE, MPI_SUM, lmp.world);
  return sum;
}
} // namespace kerf::dem
