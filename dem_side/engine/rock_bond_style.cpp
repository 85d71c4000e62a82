// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rock_bond_style.h"

#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/bond/rock_bond_law.h"
#include "dem_side/errors.h"

#include <algorithm>
#include <atom.h>
#include <contact_interface.h>
#include <domain.h>
#include <fix_property_atom.h>
#include <force.h>
#include <modify.h>
#include <neighbor.h>
#include <numeric>
#include <stdexcept>
#include <update.h>

namespace kerf::dem
{
double list_reach(const Packing &packing, const BondParameters &bond)
{
  // The elongation of an intact bond at failure, with a margin. Tests have unbreakable bonds, for which the upper limit counts.
  const double stretch = std::clamp(1.5 * bond.R_n / bond.k_n, 0.03 * packing.mean_diameter, 0.2 * packing.mean_diameter);
  double reach = 1.03;
  for (const auto &[a, b] : packing.bonds)
    reach = std::max(reach, (packing.branch(a, b).norm() + stretch) / (packing.radii[a] + packing.radii[b]));
  return reach;
}

namespace
{
LAMMPS_NS::FixPropertyAtom *find_property(LAMMPS_NS::LAMMPS &lmp, const char *name)
{
  auto *property = dynamic_cast<LAMMPS_NS::FixPropertyAtom *>(lmp.modify->fix[lmp.modify->find_fix(name)]);
  property->just_created = 0; // else the first setup would overwrite the values of inserted particles with the default
  return property;
}

Eigen::Map<const Eigen::Vector3d> row(double **array, int i)
{
  return Eigen::Map<const Eigen::Vector3d>(array[i]);
}
} // namespace

RockBondStyle::RockBondStyle(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash)
  : lmp(lmp), gran(gran), hash(hash), rotations(find_property(lmp, "kerf_rotation")),
    weights(find_property(lmp, "kerf_weight")), broken_counts(find_property(lmp, "kerf_broken"))
{
}

void RockBondStyle::settings(int, char **, LIGGGHTS::IContactHistorySetup *history)
{
  history->add_history_value("state", "0");
  history->add_history_value("rest_length", "0");
  for (const char *component : {"x", "y", "z"})
    history->add_history_value(component, "1");
}

void RockBondStyle::write_restart_settings(FILE *)
{
  throw std::invalid_argument("write_restart: the state of kerf_rock_bond cannot be written to a restart file");
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

void RockBondStyle::compute_force(LAMMPS_NS::PairGran *, int eflag, int vflag, int addflag)
{
  refuse_lists_of_contacts(addflag != 0);
  gran.evflag = gran.vflag_fdotr = 0;
  const bool step = !lmp.update->setupflag;
  if (lmp.neighbor->ago == 0)
    refresh_ghosts();
  if (step)
    ++steps;
  if (!added.empty())
  {
    create_bonds();
    check_created_bonds();
  }

  pair_forces(step);
  if (eflag || vflag)
    tally(eflag, vflag);
  if (hook && *hook)
  {
    Particles local = particles();
    (*hook)(step ? Phase::step : Phase::setup, local);
  }
  if (damps_after_hook())
    damp_all(step);
}

/// Energies and virials of the pairs for the computes pe, pressure, pe/atom and stress/atom of a script.
void RockBondStyle::tally(int eflag, int vflag)
{
  gran.ev_setup(eflag, vflag);
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const bool newton = lmp.force->newton_pair != 0;
  for (const LoadedPair &pair : loaded_pairs())
  {
    const double *x = atom.x[pair.i], *y = atom.x[pair.j], *f = pair.force.data();
    gran.ev_tally_xyz(pair.i, pair.j, atom.nlocal, newton, pair.energy, 0., f[0], f[1], f[2], x[0] - y[0], x[1] - y[1],
                      x[2] - y[2]);
  }
}

/// LIGGGHTS asks a pair style for its contacts in other ways, for which it counts pairs that overlap. Bonds have gaps.
void RockBondStyle::refuse_lists_of_contacts(bool list_asked_for) const
{
  if (list_asked_for || gran.cpl() != nullptr)
    throw std::invalid_argument("compute pair/gran/local: there is no list of the pairs of a rock bond, because LIGGGHTS lists "
                                "overlapping pairs only; use compute stress/atom, pe/atom, pressure or pe");
  if (gran.storeContactForces() || gran.storeContactForcesStress() || gran.storeSumDelta())
    throw std::invalid_argument(
      "a fix or compute of the script needs contact forces by pair, which a rock bond does not store; "
      "use compute stress/atom");
}

void RockBondStyle::damp_all(bool step)
{
  damp(step);
}

/// After particles changed rank or place: sends the data to the ghosts that LIGGGHTS does not send by itself. In the steps
/// between, every rank rotates its ghosts with the angular velocities that LIGGGHTS sends.
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

/// When LIGGGHTS builds its lists, it silently drops a bond that is longer than their reach.
void RockBondStyle::check_intact_bonds()
{
  std::int64_t sums[] = {intact_bond_ends(), bond_ends_failed, overstretched};
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_INT64_T, MPI_SUM, lmp.world);
  const bool lost = sums[0] + sums[1] != bond_ends_at_build;
  const bool explained = lmp.atom->natoms != n_particles; // particles took their bonds out of the domain
  if (sums[2] > 0 || (lost && !explained))
    throw Unstable("intact bonds were stretched far beyond their strength: the particles are unstable, the time step "
                   "is probably too large");
  bond_ends_at_build = sums[0];
  bond_ends_failed = 0;
  n_particles = lmp.atom->natoms;
}

void RockBondStyle::create_bonds()
{
  std::int64_t made = 0;
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const int *tag = atom.tag;
  const int n_local = atom.nlocal;
  const Packing &packing = *parameters.packing;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      const int a = tag[i] - 1, b = tag[j] - 1;
      if (std::max(a, b) >= packing.size() || !(added[a] || added[b]))
        return;
      const bool bonded = parameters.stored_bonds->bonded(a, b);
      if (bonded && !born_broken.count({std::min(a, b), std::max(a, b)}))
      {
        const Eigen::Vector3d stored = packing.branch(a, b);
        history.state = PairHistory::intact;
        history.rest_length = stored.norm();
        Eigen::Map<Eigen::Vector3d>(history.vector) = stored / history.rest_length;
        flag = 1;
        made += j < n_local ? 2 : 1;
        return;
      }
      // A particle was put where an older one is: what they overlap by stores no energy.
      const double *x = atom.x[i], *y = atom.x[j];
      const double distance = (Eigen::Map<const Eigen::Vector3d>(x) - Eigen::Map<const Eigen::Vector3d>(y)).norm();
      const double length = law::contact_length(atom.radius[i] + atom.radius[j], bonded ? packing.branch(a, b).norm() : 0.);
      if (!bonded && (added[a] == added[b] || distance >= length))
        return;
      history.state = PairHistory::broken;
      history.rest_length = std::min(length, distance);
      Eigen::Map<Eigen::Vector3d>(history.vector).setZero();
      flag = 1;
    });
  record_born_broken();
  added.clear();
  MPI_Allreduce(&made, &bond_ends_made, 1, MPI_INT64_T, MPI_SUM, lmp.world);
  bond_ends_at_build += bond_ends_made;
}

/// The ends may be too far apart to be listed as a pair, or on two ranks.
void RockBondStyle::record_born_broken()
{
  if (born_broken.empty())
    return;
  const Packing &packing = *parameters.packing;
  std::vector<int> local(packing.size(), -1);
  for (int i = 0; i < lmp.atom->nlocal; ++i)
    if (const int particle = lmp.atom->tag[i] - 1; particle < packing.size())
      local[particle] = i;
  for (const auto &[first, second] : born_broken)
  {
    for (const int end : {first, second})
      if (local[end] >= 0)
        broken_counts->vector_atom[local[end]] += 1.;
    if (local[first] < 0)
      continue;
    const double share = packing.radii[first] / (packing.radii[first] + packing.radii[second]);
    const Eigen::Vector3d position =
      Eigen::Map<const Eigen::Vector3d>(lmp.atom->x[local[first]]) + share * packing.branch(first, second);
    broken.push_back({steps, first, second, false, true, position});
  }
  born_broken.clear();
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
    broken.push_back({steps, std::min(tag[i], tag[j]) - 1, std::max(tag[i], tag[j]) - 1, shear, false, position});
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

double RockBondStyle::inertia(int i) const
{
  return inertia_factor(lmp.domain->dimension) * lmp.atom->rmass[i] * lmp.atom->radius[i] * lmp.atom->radius[i];
}

double RockBondStyle::kinetic(int i) const
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  return 0.5 * (atom.rmass[i] * row(atom.v, i).squaredNorm() + inertia(i) * row(atom.omega, i).squaredNorm());
}

double RockBondStyle::finite_step(int i) const
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const double dt = parameters.time_step;
  return -dt * dt / 8. * (row(atom.f, i).squaredNorm() / atom.rmass[i] + row(atom.torque, i).squaredNorm() / inertia(i));
}

/// kinetic() + finite_step() of the last step, when velocities are those of the half step after it.
double RockBondStyle::kinetic_over_step(int i) const
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const double dt = parameters.time_step;
  return kinetic(i) - 0.5 * dt * (row(atom.f, i).dot(row(atom.v, i)) + row(atom.torque, i).dot(row(atom.omega, i)));
}

bool RockBondStyle::is_outside(const double *position) const
{
  const LAMMPS_NS::Domain &domain = *lmp.domain;
  for (int c = 0; c < 3; ++c)
    if (!domain.periodicity[c] && !(position[c] >= domain.boxlo[c] && position[c] < domain.boxhi[c]))
      return true;
  return false;
}

void RockBondStyle::book_leavers(bool moved)
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  std::vector<int> here;
  for (int i = 0; i < atom.nlocal; ++i)
    if (is_outside(atom.x[i]) && !leavers.count(atom.tag[i]))
      here.push_back(i);
  int n_here = static_cast<int>(here.size()), n_ranks = 1;
  MPI_Comm_size(lmp.world, &n_ranks);
  std::vector<int> counts(n_ranks), starts(n_ranks, 0);
  MPI_Allgather(&n_here, 1, MPI_INT, counts.data(), 1, MPI_INT, lmp.world);
  std::partial_sum(counts.begin(), counts.end() - 1, starts.begin() + 1);
  std::vector<int> own, tags(starts.back() + counts.back());
  if (tags.empty())
    return;
  for (const int i : here)
    own.push_back(atom.tag[i]);
  MPI_Allgatherv(own.data(), n_here, MPI_INT, tags.data(), counts.data(), starts.data(), MPI_INT, lmp.world);
  leavers.insert(tags.begin(), tags.end());

  for (const int i : here)
    dissipation.left += moved ? kinetic_over_step(i) : kinetic(i) + finite_step(i);
  const std::set<int> leaving(tags.begin(), tags.end());
  for (const LoadedPair &pair : loaded_pairs())
    if (leaving.count(atom.tag[pair.i]) || leaving.count(atom.tag[pair.j]))
      dissipation.left += (pair.j < atom.nlocal ? 1. : 0.5) * pair.energy;
}

Energies RockBondStyle::energies()
{
  Energies sum;
  for (int i = 0; i < lmp.atom->nlocal; ++i)
  {
    sum.kinetic += kinetic(i);
    sum.finite_step += finite_step(i);
  }
  sum.elastic = lmp.atom->natoms > 0 ? elastic_energy() : 0.;
  sum.damping = dissipation.damping - damping_ahead;
  sum.friction = dissipation.friction;
  sum.released = dissipation.released;
  sum.left = dissipation.left;
  static_assert(sizeof(Energies) == 7 * sizeof(double));
  MPI_Allreduce(MPI_IN_PLACE, &sum, 7, MPI_DOUBLE, MPI_SUM, lmp.world);
  return sum;
}
} // namespace kerf::dem
