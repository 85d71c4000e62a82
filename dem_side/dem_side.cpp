// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/dem_side.h"

#include "dem_side/bond/bond_weight.h"
#include "dem_side/engine/liggghts_instance.h"
#include "dem_side/engine/rank_borders.h"
#include "dem_side/engine/rock_bond_style.h"

#include <algorithm>
#include <atom.h>
#include <atom_vec.h>
#include <comm.h>
#include <domain.h>
#include <fix.h>
#include <integrate.h>
#include <modify.h>
#include <neighbor.h>
#include <sstream>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
namespace
{
using LAMMPS_NS::LAMMPS;

void check(const Settings &s)
{
  std::ostringstream error;
  const auto positive = [&error](const char *name, double value)
  {
    if (!(value > 0.))
      error << name << " must be positive, not " << value << "; ";
  };
  const auto not_negative = [&error](const char *name, double value)
  {
    if (!(value >= 0.))
      error << name << " must not be negative, not " << value << "; ";
  };
  if (s.packing == nullptr || s.packing->size() == 0)
    throw std::invalid_argument("particles: there is no packing");
  if (s.packing->dim != 2 && s.packing->dim != 3)
    throw std::invalid_argument("particles: the packing must have 2 or 3 dimensions");
  positive("normal stiffness k_n", s.bond.k_n);
  not_negative("tangential stiffness k_t", s.bond.k_t);
  positive("tensile strength R_n", s.bond.R_n);
  positive("shear strength R_t", s.bond.R_t);
  not_negative("friction", s.bond.friction);
  not_negative("contact damping", s.bond.damping);
  not_negative("shear strength friction", s.bond.shear_friction);
  positive("density", s.density);
  positive("time step", s.time_step);
  if (!(s.local_damping >= 0. && s.local_damping < 1.))
    error << "local damping must be in [0, 1), not " << s.local_damping << "; ";
  for (int c = 0; c < s.packing->dim; ++c)
    if (s.packing->periodic[c] == 0. && !(s.domain_lower[c] < s.domain_upper[c]))
      error << "side "
            << "xyz"[c] << " of the particle domain is empty; ";
  if (!error.str().empty())
    throw std::invalid_argument("particles: " + error.str().substr(0, error.str().size() - 2));
}
} // namespace

/// The LIGGGHTS instance and what is known of the whole set of particles on every rank.
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
  std::vector<char> was_active; // by index in the packing; a particle is taken from the store only once
  int n_active = 0;
  std::vector<int> left;  // the domain, by index in the packing
  bool has_lists = false; // of the present particles
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
  Eigen::Vector3d place_of(const NewParticle &particle) const
  {
    return packing.wrapped(packing.positions.col(particle.index) + particle.displacement);
  }
  void make(const NewParticle &particle);
  std::int64_t n_bonds_to_fresh() const;
  void update_masses();
  void notice_leavers();
  void stop_if_overstretched() const;
  void check_periodic_sides() const;
  double ghost_reach() const;
  void share_out(const std::vector<NewParticle> &particles);
};

EngineBox engine_box(const Settings &settings)
{
  const Packing &packing = *settings.packing;
  EngineBox box{settings.domain_lower, settings.domain_upper, {{'f', 'f', 'f'}}};
  for (int c = 0; c < packing.dim; ++c)
    if (packing.periodic[c] > 0.)
    {
      box.lower[c] = packing.lower[c];
      box.upper[c] = packing.lower[c] + packing.periodic[c];
      box.boundary[c] = 'p';
    }
  if (packing.dim == 2)
  {
    box.lower[2] = -packing.mean_diameter;
    box.upper[2] = packing.mean_diameter;
    box.boundary[2] = 'p';
  }
  return box;
}

/// Bins of half the reach of the lists, as the engine would choose, but no more than can be visited often: the domain of a
/// large store is mostly empty. [m]
double bin_size(const EngineBox &box, int dim, double half_reach)
{
  constexpr double most = 5e5;
  const double volume = (box.upper - box.lower).head(dim).prod();
  return std::max(half_reach, std::pow(volume / most, 1. / dim));
}

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
  style = RockBondStyle::install(*lmp, {&packing, &stored_bonds, s.bond, s.time_step, s.local_damping});
  command(*lmp, "timestep ", s.time_step);
  command(*lmp, "fix motion all nve/sphere"); // in the plane nothing has a part along z that enforce2d would have to remove
  command(*lmp, "thermo 0");
  command(*lmp, "thermo_modify lost ignore");

  // One endless run: LIGGGHTS writes its output on the last step only.
  lmp->update->whichflag = 1;
  lmp->update->firststep = lmp->update->beginstep = 0;
  lmp->update->laststep = lmp->update->endstep = std::int64_t(1) << 60;
}

/// LIGGGHTS tells pairs by their tags: no particle may see two images of another one.
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

void DemSide::Engine::check(const std::vector<NewParticle> &particles) const
{
  std::vector<char> listed(packing.size(), 0);
  for (const NewParticle &particle : particles)
  {
    std::ostringstream error;
    if (particle.index < 0 || particle.index >= packing.size())
      error << "is not in the store, which has " << packing.size() << " particles";
    else if (was_active[particle.index] || listed[particle.index])
      error << "was inserted before";
    else
    {
      listed[particle.index] = 1;
      const Eigen::Vector3d position = place_of(particle);
      for (int c = 0; c < packing.dim; ++c)
        if (!(position[c] >= box.lower[c] && position[c] < box.upper[c]))
        {
          error << "is outside of the particle domain, "
                << "xyz"[c] << " = " << position[c];
          break;
        }
      if (!(particle.velocity.allFinite() && particle.rotation.allFinite() && particle.angular_velocity.allFinite()))
        error << "has a velocity or rotation that is not a number";
    }
    if (!error.str().empty())
      throw std::invalid_argument("particle " + std::to_string(particle.index) + " to insert " + error.str());
  }
}

/// Creates the particle on this rank; its mass follows in update_masses().
void DemSide::Engine::make(const NewParticle &particle)
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  Eigen::Vector3d position = place_of(particle);
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
  const double angle = particle.rotation.norm();
  const Eigen::Vector3d axis = angle > 0. ? Eigen::Vector3d(particle.rotation / angle) : Eigen::Vector3d::UnitZ();
  style->initialise(i, weights[particle.index], Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)));
}

/// How far the lists of a particle look at most [m].
double DemSide::Engine::ghost_reach() const
{
  return list_reach(packing, settings.bond) * 2. * packing.radii.maxCoeff() + list_skin(packing);
}

/// Moves the borders between the ranks so that they have equal numbers of particles, the new ones included: a region that was
/// activated is small and far from the middle of the domain. Particles that are there go to a neighbouring rank at most, which
/// is what LIGGGHTS does with them in its next setup.
void DemSide::Engine::share_out(const std::vector<NewParticle> &particles)
{
  constexpr int n_bins = 4096;
  constexpr double bearable = 1.1; // fullest rank by the mean
  LAMMPS_NS::Comm &comm = *lmp->comm;
  const LAMMPS_NS::Domain &domain = *lmp->domain;
  double *const splits[3] = {comm.xsplit, comm.ysplit, comm.zsplit};
  bool changed = false;
  for (int c = 0; c < packing.dim; ++c)
  {
    if (comm.procgrid[c] == 1)
      continue;
    const double length = domain.boxhi[c] - domain.boxlo[c], thinnest = ghost_reach() / length;
    const Borders now(splits[c], splits[c] + comm.procgrid[c] + 1);
    bool thick = true; // segments that are thinner than the lists reach stay as they are
    for (int k = 0; k < comm.procgrid[c]; ++k)
      thick = thick && now[k + 1] - now[k] >= thinnest;
    if (!thick)
      continue;
    std::vector<double> counts(n_bins, 0.);
    const auto add = [&](double x)
    { ++counts[std::clamp(static_cast<int>(n_bins * (x - domain.boxlo[c]) / length), 0, n_bins - 1)]; };
    for (int i = 0; i < lmp->atom->nlocal; ++i)
      add(lmp->atom->x[i][c]);
    MPI_Allreduce(MPI_IN_PLACE, counts.data(), n_bins, MPI_DOUBLE, MPI_SUM, lmp->world);
    for (const NewParticle &particle : particles) // every rank knows them
      add(place_of(particle)[c]);
    if (imbalance(counts, now) <= bearable)
      continue;
    const Borders target = balanced_borders(counts, comm.procgrid[c], thinnest);
    const Borders next = n_active == 0 ? target : approach(now, target, thinnest);
    std::copy(next.begin(), next.end(), splits[c]);
    changed = true;
  }
  if (!changed)
    return;
  comm.uniform = 0; // "not equal": the borders are to be read
  lmp->domain->set_local_box();
}

std::int64_t DemSide::Engine::n_bonds_to_fresh() const
{
  std::int64_t n = 0;
  for (int i = 0; i < static_cast<int>(style->added.size()); ++i)
    if (style->added[i])
      for (const int j : stored_bonds.partners_of(i))
        n += active[j] && (!style->added[j] || i < j);
  return n;
}

void DemSide::Engine::update_masses()
{
  LAMMPS_NS::Atom &atom = *lmp->atom;
  for (int i = 0; i < atom.nlocal + atom.nghost; ++i)
  {
    const int particle = atom.tag[i] - 1;
    atom.rmass[i] = settings.density * packing.volume(particle) * mass_weight(particle, packing, stored_bonds, active, weights);
  }
}

/// LIGGGHTS takes particles outside of the box away when it exchanges them between ranks.
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
    throw std::runtime_error("an intact bond is stretched far beyond its strength: the particles are unstable");
}

DemSide::DemSide(const Settings &settings)
{
  check(settings);
  engine = std::make_unique<Engine>(settings);
}

DemSide::~DemSide() = default;

void DemSide::insert(const std::vector<NewParticle> &particles)
{
  Engine &e = *engine;
  e.check(particles);
  if (particles.empty())
    return;
  if (e.n_active == 0 || e.has_lists) // particles can move on by one rank only until the next setup
    e.share_out(particles);
  LAMMPS_NS::Atom &atom = *e.lmp->atom;
  const LAMMPS_NS::Domain &domain = *e.lmp->domain;

  // The contact state is in the lists, whose ghosts are about to be overwritten: bring it to the particles first.
  if (e.n_active > 0)
    e.lmp->modify->setup_pre_exchange();
  atom.nghost = 0;
  std::int64_t made = 0;
  for (const NewParticle &particle : particles)
  {
    const Eigen::Vector3d position = e.place_of(particle);
    bool mine = true;
    for (int c = 0; c < e.packing.dim; ++c)
      mine = mine && position[c] >= domain.sublo[c] && position[c] < domain.subhi[c];
    if (mine)
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
  e.n_active += static_cast<int>(particles.size());
  e.style->n_particles += particles.size();
  ++e.style->order;
  e.has_lists = e.is_set_up = false;
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
      throw std::invalid_argument("particle " + std::to_string(i) + " to remove is not active or is named twice");
    goes[i] = 1;
    e.active[i] = e.was_active[i] = 0;
  }
  // As in insert(): the contact state goes with the particles, and the ghosts become invalid.
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
    throw std::invalid_argument("there must be one weight for each particle of the store");
  for (int i = 0; i < weight.size(); ++i)
    if (e.active[i] && !(weight[i] >= 0. && weight[i] <= 1.))
      throw std::invalid_argument("the weight of particle " + std::to_string(i) + " must be in [0, 1], not " +
                                  std::to_string(weight[i]));
  for (int i = 0; i < weight.size(); ++i)
    if (e.active[i] && weight[i] == 0.)
    {
      const auto partners = e.stored_bonds.partners_of(i);
      if (std::none_of(partners.begin(), partners.end(), [&](int j) { return e.active[j] && weight[j] > 0.; }))
        throw std::invalid_argument("particle " + std::to_string(i) +
                                    " has no mass: its weight is zero and it is bonded to no particle with weight");
    }
  e.weights = weight;
  for (int i = 0; i < e.lmp->atom->nlocal; ++i)
    e.style->set_weight(i, weight[e.lmp->atom->tag[i] - 1]);
  e.style->constants_changed = true;
  e.is_set_up = false;
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
  const std::int64_t expected = e.n_bonds_to_fresh();
  e.style->bond_ends_made = 0;
  e.style->hook = &hook;
  e.lmp->init();
  e.lmp->update->integrate->setup();
  e.style->hook = nullptr;
  e.has_lists = e.is_set_up = true;
  e.notice_leavers();
  const std::int64_t made = e.style->bond_ends_made / 2;
  if (made != expected)
    throw std::runtime_error("only " + std::to_string(made) + " of " + std::to_string(expected) +
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
  e.lmp->neighbor->ago = 1; // these lists are known
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
} // namespace kerf::dem
