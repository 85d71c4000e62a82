// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/dem_side.h"

#include "dem_side/bond/bond_weight.h"
#include "dem_side/bond/rock_bond_law.h"
#include "dem_side/engine/balance_ranks.h"
#include "dem_side/engine/install_rock_bond.h"
#include "dem_side/engine/liggghts_instance.h"
#include "dem_side/errors.h"

#include <algorithm>
#include <atom.h>
#include <atom_vec.h>
#include <cmath>
#include <comm.h>
#include <domain.h>
#include <fix.h>
#include <integrate.h>
#include <modify.h>
#include <neighbor.h>
#include <sstream>
#include <stdexcept>
#include <universe.h>
#include <update.h>

namespace kerf::dem
{
namespace
{
using LAMMPS_NS::LAMMPS;

/// Size of the engine's bins [m]: half the reach of the lists, as the engine would choose, but larger when there would be too
/// many bins to loop over often. The domain of a large store is mostly empty.
double bin_size(const EngineBox &box, int dim, double half_reach)
{
  constexpr double most = 5e5;
  const double volume = (box.upper - box.lower).head(dim).prod();
  return std::max(half_reach, std::pow(volume / most, 1. / dim));
}
} // namespace

/// The LIGGGHTS instance, and the data of the whole set of particles that every rank has.
struct DemSide::Engine
{
  explicit Engine(const Settings &settings);

  Settings settings;
  const Packing &packing;
  const EngineBox box;
  StoredBonds stored_bonds;
  std::unique_ptr<LAMMPS> lmp;
  RockBondStyle *style = nullptr; // owned by LIGGGHTS

  Eigen::VectorXd weights;      // by index in the packing
  std::vector<char> active;     // by index in the packing
  std::vector<char> was_active; // by index in the packing: see DemSide::is_taken()
  int n_active = 0;
  std::vector<int> left;  // indices of the particles that left the domain
  bool has_lists = false; // the neighbour lists contain the present particles
  bool is_set_up = false; // the forces belong to the present particles and weights

  std::int64_t total(std::int64_t of_rank) const
  {
    MPI_Allreduce(MPI_IN_PLACE, &of_rank, 1, MPI_INT64_T, MPI_SUM, lmp->world);
    return of_rank;
  }
  void require_set_up(const char *caller) const
  {
    if (n_active > 0 && !is_set_up)
      throw std::logic_error(std::string("DemSide::") + caller + " needs setup() after insert() or set_weights()");
  }
  void check(const std::vector<NewParticle> &particles) const;
  Eigen::Vector3d position_of(const NewParticle &particle) const
  {
    return packing.wrapped(packing.positions.col(particle.index) + particle.displacement);
  }
  static Eigen::Quaterniond rotation_of(const NewParticle &particle)
  {
    const double angle = particle.rotation.norm();
    const Eigen::Vector3d axis = angle > 0. ? Eigen::Vector3d(particle.rotation / angle) : Eigen::Vector3d::UnitZ();
    return Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis));
  }
  void make(const NewParticle &particle);
  template <int dim>
  std::vector<StoredPair> misfitting_bonds(const std::vector<NewParticle> &particles,
                                           const std::unordered_map<int, NewParticle> &expected) const;
  std::int64_t n_bonds_to_new() const;
  double mass(int particle, const std::vector<char> &among, const Eigen::VectorXd &weight) const
  {
    return settings.density * packing.volume(particle) * mass_weight(particle, packing, stored_bonds, among, weight);
  }
  void update_masses();
  void notice_leavers();
  void stop_if_overstretched() const;
  void check_periodic_sides() const;
  double ghost_reach() const;
  std::vector<Eigen::Vector3d> positions_of(const std::vector<NewParticle> &particles) const;
};

DemSide::Engine::Engine(const Settings &s)
  : settings(s), packing(*s.packing), box(engine_box(s)), stored_bonds(packing), lmp(make_liggghts(s.comm)),
    weights(Eigen::VectorXd::Ones(packing.size())), active(packing.size(), 0), was_active(packing.size(), 0)
{
  check_periodic_sides();
  command(*lmp, "units si");
  command(*lmp, "dimension ", packing.dim);
  command(*lmp, "atom_style granular");
  const double bin = bin_size(box, packing.dim, 0.5 * ghost_reach());
  command(*lmp, "atom_modify map array sort 1000 ", bin);
  command(*lmp, "boundary ", box.boundary[0], ' ', box.boundary[1], ' ', box.boundary[2]);
  command(*lmp, "newton off");
  command(*lmp, "communicate single vel yes");
  command(*lmp, "region domain block ", box.lower.x(), ' ', box.upper.x(), ' ', box.lower.y(), ' ', box.upper.y(), ' ',
          box.lower.z(), ' ', box.upper.z(), " units box");
  command(*lmp, "create_box 1 domain");
  command(*lmp, "neighbor ", list_skin(packing), " bin");
  command(*lmp, "neigh_modify delay 0 every 1 check yes binsize ", bin, " contact_distance_factor ",
          list_reach(packing, s.bond));
  style = &install_rock_bond(*lmp, {&packing, &stored_bonds, s.bond, s.time_step, s.local_damping});
  command(*lmp, "timestep ", s.time_step);
  command(*lmp,
          "fix motion all nve/sphere"); // without enforce2d: in two dimensions no force or velocity has a component along z
  command(*lmp, "thermo 0");
  command(*lmp, "thermo_modify lost ignore");

  // One endless run: LIGGGHTS writes its output on the last step only.
  lmp->update->whichflag = 1;
  lmp->update->firststep = lmp->update->beginstep = 0;
  lmp->update->laststep = lmp->update->endstep = std::int64_t(1) << 60;
}

/// LIGGGHTS identifies pairs by their tags, so no particle may see two images of another one.
void DemSide::Engine::check_periodic_sides() const
{
  const double least = 2. * ghost_reach();
  for (int c = 0; c < packing.dim; ++c)
    if (packing.periodic[c] > 0. && packing.periodic[c] <= least)
    {
      std::ostringstream error;
      error << "particles: side "
            << "xyz"[c] << " of the periodic box is " << packing.periodic[c] << " m long, it must be longer than " << least
            << " m, twice the reach of the neighbour lists";
      throw std::invalid_argument(error.str());
    }
}

/// The list is the caller's: std::logic_error. The state comes from a calculation: Unstable.
void DemSide::Engine::check(const std::vector<NewParticle> &particles) const
{
  std::vector<char> listed(packing.size(), 0);
  for (const NewParticle &particle : particles)
  {
    const std::string name = "particle " + std::to_string(particle.index) + " to insert ";
    if (particle.index < 0 || particle.index >= packing.size())
      throw std::logic_error(name + "is not in the store, which has " + std::to_string(packing.size()) + " particles");
    if (was_active[particle.index] || listed[particle.index])
      throw std::logic_error(name + "was inserted before");
    listed[particle.index] = 1;
    const Eigen::Vector3d position = position_of(particle);
    for (int c = 0; c < packing.dim; ++c)
      if (!(position[c] >= box.lower[c] && position[c] < box.upper[c]))
      {
        std::ostringstream error;
        error << name << "is outside of the particle domain, "
              << "xyz"[c] << " = " << position[c];
        throw Unstable(error.str());
      }
    if (!(particle.velocity.allFinite() && particle.rotation.allFinite() && particle.angular_velocity.allFinite()))
      throw Unstable(name + "has a velocity or rotation that is not a number");
  }
}

/// Creates the particle on this rank; its mass follows in update_masses().
void DemSide::Engine::make(const NewParticle &particle)
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  Eigen::Vector3d position = position_of(particle);
  atom.avec->create_atom(1, position.data());
  const int i = atom.nlocal - 1;
  atom.tag[i] = particle.index + 1;
  atom.radius[i] = packing.radii[particle.index];
  atom.density[i] = settings.density;
  Eigen::Map<Eigen::Vector3d>(atom.v[i]) = particle.velocity;
  Eigen::Map<Eigen::Vector3d>(atom.omega[i]) = particle.angular_velocity;
  for (int f = 0; f < lmp->modify->nfix; ++f)
    if (lmp->modify->fix[f]->create_attribute)
      lmp->modify->fix[f]->set_arrays(i);
  style->initialise(i, weights[particle.index], rotation_of(particle));
}

/// Largest reach of the neighbour lists [m].
double DemSide::Engine::ghost_reach() const
{
  return list_reach(packing, settings.bond) * 2. * packing.radii.maxCoeff() + list_skin(packing);
}

std::vector<Eigen::Vector3d> DemSide::Engine::positions_of(const std::vector<NewParticle> &particles) const
{
  std::vector<Eigen::Vector3d> positions;
  for (const NewParticle &particle : particles)
    positions.push_back(position_of(particle));
  return positions;
}

std::int64_t DemSide::Engine::n_bonds_to_new() const
{
  std::int64_t n = 0;
  for (int i = 0; i < static_cast<int>(style->added.size()); ++i)
    if (style->added[i])
      for (const int j : stored_bonds.partners_of(i))
        n += active[j] && (!style->added[j] || i < j);
  return n - static_cast<std::int64_t>(style->born_broken.size());
}

void DemSide::Engine::update_masses()
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  for (int i = 0; i < atom.nlocal + atom.nghost; ++i)
    atom.rmass[i] = mass(atom.tag[i] - 1, active, weights);
}

/// LIGGGHTS deletes particles outside of the box when it exchanges particles between ranks.
void DemSide::Engine::notice_leavers()
{
  if (lmp->atom->natoms == n_active)
    return;
  const std::vector<char> before = active;
  std::vector<char> here(packing.size(), 0);
  for (int i = 0; i < lmp->atom->nlocal; ++i)
    here[lmp->atom->tag[i] - 1] = 1;
  MPI_Allreduce(here.data(), active.data(), packing.size(), MPI_CHAR, MPI_MAX, lmp->world);
  for (int i = 0; i < packing.size(); ++i)
    if (before[i] && !active[i])
      left.push_back(i);
  n_active = static_cast<int>(lmp->atom->natoms);
}

void DemSide::Engine::stop_if_overstretched() const
{
  if (total(style->overstretched) > 0)
    throw Unstable("an intact bond is stretched far beyond its strength: the particles are unstable");
}

DemSide::DemSide(const Settings &settings)
{
  check_settings(settings);
  engine = std::make_unique<Engine>(settings);
}

DemSide::~DemSide() = default;

void DemSide::insert(const std::vector<NewParticle> &particles, const std::vector<StoredPair> &broken)
{
  Engine &e = *engine;
  e.check(particles);
  if (particles.empty())
    return;
  if (e.n_active == 0 || e.has_lists) // until the next setup a particle can move by one rank only
    balance_ranks(*e.lmp, e.positions_of(particles), e.ghost_reach(), e.n_active == 0);
  LAMMPS_NS::Atom &atom = *e.lmp->atom;
  const LAMMPS_NS::Domain &domain = *e.lmp->domain;

  // The neighbour lists hold the contact state. Copy it to the particles before their ghosts are overwritten.
  if (e.n_active > 0)
    e.lmp->modify->setup_pre_exchange();
  atom.nghost = 0;
  std::int64_t made = 0;
  for (const NewParticle &particle : particles)
  {
    const Eigen::Vector3d position = e.position_of(particle);
    bool is_local = true;
    for (int c = 0; c < e.packing.dim; ++c)
      is_local = is_local && position[c] >= domain.sublo[c] && position[c] < domain.subhi[c];
    if (is_local)
    {
      e.make(particle);
      ++made;
    }
  }
  if (e.total(made) != static_cast<std::int64_t>(particles.size()))
    throw std::logic_error("inserted particles were taken by no rank or by two");
  atom.natoms += particles.size();
  atom.map_init();
  atom.map_set();

  e.style->added.resize(e.packing.size(), 0);
  for (const NewParticle &particle : particles)
    e.active[particle.index] = e.was_active[particle.index] = e.style->added[particle.index] = 1;
  e.style->born_broken.insert(broken.begin(), broken.end());
  e.n_active += static_cast<int>(particles.size());
  e.style->n_particles += particles.size();
  ++e.style->order;
  e.has_lists = e.is_set_up = false;
}

template <int dim>
std::vector<StoredPair> DemSide::Engine::misfitting_bonds(const std::vector<NewParticle> &particles,
                                                          const std::unordered_map<int, NewParticle> &expected) const
{
  struct State
  {
    Eigen::Vector3d position;
    Eigen::Quaterniond rotation;
  };
  std::unordered_map<int, State> present; // of the partners on this rank
  const Particles here = style->particles();
  for (int i = 0; i < here.n; ++i)
    if (expected.count(here.index[i]))
    {
      const double *q = here.rotation + 4 * i;
      present[here.index[i]] = {here.position.col(i), Eigen::Quaterniond(q[0], q[1], q[2], q[3])};
    }
  const auto state_of = [this](const NewParticle &particle) { return State{position_of(particle), rotation_of(particle)}; };
  const auto strain = [this](int i, const State &a, int j, const State &b)
  {
    const Eigen::Vector3d stored = packing.branch(i, j);
    const Eigen::Vector3d to = a.position + packing.shortest(b.position - a.position), normal = stored.normalized();
    return law::bond_strain<dim, double>(
      law::make_pair<dim, double>(a.position.template head<dim>(), to.template head<dim>(), packing.radii[i], packing.radii[j]),
      stored.norm(), (a.rotation * normal).template head<dim>(), (b.rotation * normal).template head<dim>());
  };
  std::vector<StoredPair> misfits;
  for (const NewParticle &particle : particles)
    for (const int partner : stored_bonds.partners_of(particle.index))
      if (const auto actual = present.find(partner); actual != present.end())
      {
        const State own = state_of(particle);
        if (law::misfits<dim>(strain(particle.index, own, partner, actual->second),
                              strain(particle.index, own, partner, state_of(expected.at(partner))), settings.bond))
          misfits.push_back({std::min(particle.index, partner), std::max(particle.index, partner)});
      }
  return misfits;
}

std::vector<StoredPair> DemSide::misfitting_bonds(const std::vector<NewParticle> &particles,
                                                  const std::unordered_map<int, NewParticle> &expected) const
{
  return engine->packing.dim == 2 ? engine->misfitting_bonds<2>(particles, expected)
                                  : engine->misfitting_bonds<3>(particles, expected);
}

void DemSide::remove(const std::vector<int> &particles)
{
  Engine &e = *engine;
  if (particles.empty())
    return;
  std::vector<char> goes(e.packing.size(), 0);
  for (const int i : particles)
  {
    if (i < 0 || i >= e.packing.size() || !e.active[i] || goes[i])
      throw std::logic_error("particle " + std::to_string(i) + " to remove is not active or is named twice");
    goes[i] = 1;
    e.active[i] = e.was_active[i] = 0;
  }
  // As in insert(): the contact state moves with the particles, and the ghosts become invalid.
  LAMMPS_NS::Atom &atom = *e.lmp->atom;
  e.lmp->modify->setup_pre_exchange();
  atom.nghost = 0;
  for (int i = 0; i < atom.nlocal;)
    if (goes[atom.tag[i] - 1])
      atom.avec->copy(--atom.nlocal, i, 1);
    else
      ++i;
  atom.natoms -= particles.size();
  atom.map_init();
  atom.map_set();
  e.n_active -= static_cast<int>(particles.size());
  ++e.style->order;
  e.has_lists = e.is_set_up = false;
}

void DemSide::set_weights(const Eigen::VectorXd &weight)
{
  Engine &e = *engine;
  if (weight.size() != e.packing.size())
    throw std::logic_error("there must be one weight for each particle of the store");
  for (int i = 0; i < weight.size(); ++i)
    if (e.active[i] && !(weight[i] >= 0. && weight[i] <= 1.))
      throw std::logic_error("the weight of particle " + std::to_string(i) + " must be in [0, 1], not " +
                             std::to_string(weight[i]));
  for (int i = 0; i < weight.size(); ++i)
    if (e.active[i] && weight[i] == 0.)
    {
      const auto partners = e.stored_bonds.partners_of(i);
      if (std::none_of(partners.begin(), partners.end(), [&](int j) { return e.active[j] && weight[j] > 0.; }))
        throw std::logic_error("particle " + std::to_string(i) +
                               " has no mass: its weight is zero and it is bonded to no particle with weight");
    }
  e.weights = weight;
  for (int i = 0; i < e.lmp->atom->nlocal; ++i)
    e.style->set_weight(i, weight[e.lmp->atom->tag[i] - 1]);
  e.style->constants_changed = true;
  e.is_set_up = false;
}

void DemSide::prepare_weights(const Eigen::VectorXd &weight, const std::vector<int> &leaving)
{
  if (engine->n_active == 0)
    return;
  engine->require_set_up("prepare_weights()");
  std::vector<char> leaves(engine->packing.size(), 0);
  for (const int i : leaving)
    leaves[i] = 1;
  engine->style->prepare_weights(weight, leaves);
}

std::vector<double> DemSide::masses_with(const std::vector<NewParticle> &added, const Eigen::VectorXd &weight) const
{
  const Engine &e = *engine;
  std::vector<char> active = e.active;
  for (const NewParticle &particle : added)
    active[particle.index] = 1;
  std::vector<double> masses(e.lmp->atom->nlocal);
  for (std::size_t i = 0; i < masses.size(); ++i)
    masses[i] = e.mass(e.lmp->atom->tag[i] - 1, active, weight);
  return masses;
}

void DemSide::setup(const ForceHook &hook)
{
  Engine &e = *engine;
  if (e.n_active == 0)
  {
    Particles none = particles();
    if (hook)
      hook(Phase::setup, none);
    return;
  }
  e.update_masses();
  const std::int64_t expected = e.n_bonds_to_new();
  e.style->bond_ends_made = 0;
  e.style->hook = &hook;
  e.lmp->init();
  e.lmp->update->integrate->setup();
  e.style->hook = nullptr;
  e.has_lists = e.is_set_up = true;
  e.notice_leavers();
  const std::int64_t made = e.style->bond_ends_made / 2;
  if (made != expected)
    throw Unstable("only " + std::to_string(made) + " of " + std::to_string(expected) +
                   " bonds of the inserted particles could be made: particles are displaced too far from their "
                   "stored positions");
}

void DemSide::compute_forces(const ForceHook &hook)
{
  Engine &e = *engine;
  if (e.n_active == 0)
    return setup(hook);
  if (!e.has_lists)
    throw std::logic_error("DemSide::compute_forces() needs setup() after insert() or remove()");
  if (e.style->constants_changed)
    e.update_masses();
  e.lmp->neighbor->ago = 1; // not 0, which means new lists
  e.lmp->comm->forward_comm();
  e.style->send_to_ghosts();
  e.style->hook = &hook;
  e.lmp->update->integrate->setup_minimal(0);
  e.style->hook = nullptr;
  e.is_set_up = true;
}

void DemSide::advance(int steps, const ForceHook &hook)
{
  Engine &e = *engine;
  e.require_set_up("advance()");
  if (e.n_active == 0)
  {
    for (int i = 0; i < steps; ++i)
    {
      ++e.style->steps;
      Particles none = particles();
      if (hook)
        hook(Phase::step, none);
    }
    return;
  }
  e.style->hook = &hook;
  e.lmp->update->integrate->run(steps);
  e.style->hook = nullptr;
  e.notice_leavers();
  e.stop_if_overstretched();
}

Particles DemSide::particles()
{
  return engine->style->particles();
}
int DemSide::n_active() const
{
  return engine->n_active;
}
const std::vector<char> &DemSide::is_active() const
{
  return engine->active;
}
const std::vector<char> &DemSide::is_taken() const
{
  return engine->was_active;
}
const std::vector<int> &DemSide::left_domain() const
{
  return engine->left;
}

std::int64_t DemSide::n_bonds_intact() const
{
  engine->require_set_up("n_bonds_intact()");
  return engine->n_active > 0 ? engine->total(engine->style->intact_bond_ends()) / 2 : 0;
}

std::int64_t DemSide::n_bonds_broken() const
{
  return engine->total(static_cast<std::int64_t>(engine->style->broken.size()));
}

std::vector<BrokenBond> DemSide::broken_bonds() const
{
  return engine->style->broken;
}

std::vector<ActiveBond> DemSide::bonds(const std::vector<char> &target) const
{
  engine->require_set_up("bonds()");
  return engine->n_active > 0 ? engine->style->bonds(target) : std::vector<ActiveBond>();
}

Energies DemSide::energies() const
{
  Engine &e = *engine;
  e.require_set_up("energies()");
  return e.style->energies();
}

std::vector<double> DemSide::damage() const
{
  const LAMMPS_NS::Atom &atom = *engine->lmp->atom;
  std::vector<double> damage(atom.nlocal, 0.);
  for (int i = 0; i < atom.nlocal; ++i)
    if (const int stored = engine->stored_bonds.count(atom.tag[i] - 1); stored > 0)
      damage[i] = engine->style->broken_count(i) / stored;
  return damage;
}

std::string library_version()
{
  static const std::string version = []
  {
    // "Version LIGGGHTS-PUBLIC 3.8.0, compiled ..."
    const std::string text = make_liggghts(MPI_COMM_SELF)->universe->version;
    const auto name = text.find("LIGGGHTS");
    const auto number = text.find(' ', name);
    if (name == std::string::npos || number == std::string::npos)
      return text;
    return "LIGGGHTS" + text.substr(number, text.find(',', number) - number);
  }();
  return version;
}
} // namespace kerf::dem
