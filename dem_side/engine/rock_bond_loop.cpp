// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rock_bond_loop.h"

#include "dem_side/bond/bond_weight.h"

#include <atom.h>
#include <cstring>
#include <neighbor.h>

namespace kerf::dem
{
namespace
{
template <int dim>
Eigen::Map<const law::Vector<dim>> vector(const double *v)
{
  return Eigen::Map<const law::Vector<dim>>(v);
}
template <int dim>
Eigen::Map<law::Vector<dim>> vector(double *v)
{
  return Eigen::Map<law::Vector<dim>>(v);
}
/// The rotation about z is the last component of LIGGGHTS' arrays.
template <int dim>
Eigen::Map<const law::Spin<dim>> spin(const double *v)
{
  return Eigen::Map<const law::Spin<dim>>(v + (dim == 2 ? 2 : 0));
}
template <int dim>
Eigen::Map<law::Spin<dim>> spin(double *v)
{
  return Eigen::Map<law::Spin<dim>>(v + (dim == 2 ? 2 : 0));
}
template <int dim>
constexpr double inertia_factor = dim == 2 ? 0.5 : 0.4; // J = factor m r^2 of a disc, a sphere

/// Cosine and sin(a) / a of an angle given by its square.
struct Angle
{
  Lanes cosine, sinc;
  explicit Angle(const Lanes &square)
    : cosine(1. - square / 2. * (1. - square / 12. * (1. - square / 30.))), // remainders of the series below 1e-3: 1e-15
      sinc(1. - square / 6. * (1. - square / 20. * (1. - square / 42.)))
  {
    if (__builtin_expect(!any(square >= 1e-3), true))
      return;
    for (int lane = 0; lane < Lanes::size; ++lane)
      if (square[lane] >= 1e-3)
      {
        const double angle = std::sqrt(square[lane]);
        cosine.set(lane, std::cos(angle));
        sinc.set(lane, std::sin(angle) / angle);
      }
  }
};

/// Turns the unit quaternion q by the constant rate w over dt: q <- exp(w dt / 2) q.
template <int dim>
void turn(Lanes *q, const law::Spin<dim, Lanes> &w, double dt)
{
  const law::Spin<dim, Lanes> half = Lanes(0.5 * dt) * w;
  const Angle angle(half.squaredNorm());
  const law::Spin<dim, Lanes> axis = angle.sinc * half;
  // A Newton step keeps the norm from drifting by round-off.
  if constexpr (dim == 2)
  {
    const Lanes real = angle.cosine * q[0] - axis[0] * q[3], z = angle.cosine * q[3] + axis[0] * q[0];
    const Lanes unit = 1.5 - 0.5 * (real * real + z * z);
    q[0] = unit * real;
    q[3] = unit * z;
  }
  else
  {
    const law::Vector<3, Lanes> now(q[1], q[2], q[3]);
    const Lanes real = angle.cosine * q[0] - axis.dot(now);
    const law::Vector<3, Lanes> next = angle.cosine * now + q[0] * axis + law::cross(axis, now);
    const Lanes unit = 1.5 - 0.5 * (real * real + next.squaredNorm());
    q[0] = unit * real;
    for (int c = 0; c < 3; ++c)
      q[1 + c] = unit * next[c];
  }
}

void set_rotation(ParticleRow<2> *rows, int n, Lanes *q)
{
  const Lanes cosine = q[0] * q[0] - q[3] * q[3], sine = 2. * q[0] * q[3];
  for (int lane = 0; lane < n; ++lane)
  {
    rows[lane].cosine = cosine[lane];
    rows[lane].sine = sine[lane];
  }
}
void set_rotation(ParticleRow<3> *rows, int n, Lanes *q)
{
  transpose(q[0], q[1], q[2], q[3]);
  for (int lane = 0; lane < n; ++lane)
    std::memcpy(rows[lane].quaternion, &q[lane].v, sizeof(Lanes));
}
} // namespace

/// What changes with the lists only.
template <int dim>
void RockBondLoop<dim>::load_constants()
{
  const LAMMPS_NS::Atom &atom = *lmp.atom;
  const int n = atom.nlocal + atom.nghost;
  rows.assign(n, Row{});
  for (int i = 0; i < n; ++i)
  {
    rows[i].position = vector<dim>(atom.x[i]);
    rows[i].radius = atom.radius[i];
    rows[i].mass = atom.rmass[i];
    rows[i].weighted_radius = weighted_radius(atom.radius[i], weight()[i]);
  }
}

template <int dim>
void RockBondLoop<dim>::collect_pairs()
{
  debris_pairs.clear();
  listed.clear();
  typename IntactBonds<dim>::Place place;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      place = {i, place.particle == i ? place.neighbour + 1 : 0};
      const OrderedPair pair = ordered(i, j);
      if (history.state == PairHistory::intact)
        listed.push_back({pair.first, pair.second, pair.sign * vector<dim>(history.vector), history.rest_length, pair.weight,
                          pair.rolling, viscosity(pair), place});
      else
        debris_pairs.push_back(loose(pair, history, flag));
    });
  intact.assign(listed);
}

/// Positions, velocities and rotations of the step. The loads are zero since they were taken away.
template <int dim>
void RockBondLoop<dim>::load_rows(bool step)
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const int n = atom.nlocal + atom.nghost;
  double *rotations = rotation();
  // LIGGGHTS' arrays are contiguous; its pointers to their rows would be more to read.
  const double *x = n > 0 ? atom.x[0] : nullptr, *v = n > 0 ? atom.v[0] : nullptr, *omega = n > 0 ? atom.omega[0] : nullptr;
  moved = 0.;
  for (int begin = 0; begin < n; begin += Lanes::size)
  {
    const int count = std::min(n - begin, Lanes::size);
    // All particles go through the same lanes: a ghost must turn like its owner to the last bit.
    Lanes q[4];
    law::Spin<dim, Lanes> w;
    for (int lane = 0; lane < Lanes::size; ++lane)
    {
      const int i = std::min(begin + lane, n - 1);
      std::memcpy(&q[lane].v, rotations + 4 * i, sizeof(Lanes));
      const auto rate = spin<dim>(omega + 3 * i);
      for (int c = 0; c < w.size(); ++c)
        w[c].set(lane, rate[c]);
    }
    transpose(q[0], q[1], q[2], q[3]);
    if (step)
    {
      turn<dim>(q, w, parameters.time_step);
      Lanes turned[] = {q[0], q[1], q[2], q[3]};
      transpose(turned[0], turned[1], turned[2], turned[3]);
      std::memcpy(rotations + 4 * begin, turned, count * sizeof(Lanes));
    }
    set_rotation(&rows[begin], count, q);
    for (int i = begin; i < begin + count; ++i)
    {
      Row &row = rows[i];
      row.position = vector<dim>(x + 3 * i);
      row.velocity = vector<dim>(v + 3 * i);
      row.spin = spin<dim>(omega + 3 * i);
    }
    if (!debris_pairs.empty() && !looked_from.empty())
      for (int i = begin; i < begin + count; ++i)
        moved = std::max(moved, (rows[i].position - looked_from[i]).squaredNorm());
  }
}

template <int dim>
void RockBondLoop<dim>::find_near_pairs()
{
  const double gap = 0.05 * parameters.packing->mean_diameter; // any: a wider one is looked at less often
  if (!looked_from.empty() && moved < 0.25 * gap * gap)
    return;
  near_pairs.clear();
  for (int k = 0; k < static_cast<int>(debris_pairs.size()); ++k)
  {
    const DebrisPair &loose = debris_pairs[k];
    const double distance = (rows[loose.pair.second].position - rows[loose.pair.first].position).norm();
    // A contact that has opened still has a spring to give up.
    if (distance < loose.length + gap || !vector<dim>(loose.history->vector).isZero(0.))
      near_pairs.push_back(k);
  }
  looked_from.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    looked_from[i] = rows[i].position;
}

/// Takes the loads out of the rows.
template <int dim>
void RockBondLoop<dim>::store_forces()
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const int n = atom.nlocal;
  double *force = n > 0 ? atom.f[0] : nullptr, *torque = n > 0 ? atom.torque[0] : nullptr;
  viscous.resize(n);
  for (int i = 0; i < static_cast<int>(rows.size()); ++i)
  {
    Row &row = rows[i];
    if (i < n)
    {
      vector<dim>(force + 3 * i) += row.force + row.damping_force;
      spin<dim>(torque + 3 * i) += row.torque + row.damping_torque;
      viscous[i] = {row.damping_force, row.damping_torque};
    }
    row.force.setZero();
    row.torque.setZero();
    row.damping_force.setZero();
    row.damping_torque.setZero();
  }
}

template <int dim>
void RockBondLoop<dim>::pair_forces(bool step)
{
  if (lmp.neighbor->ago == 0 || constants_changed)
  {
    constants_changed = false;
    load_constants();
    collect_pairs();
    near_pairs.clear(); // of the lists before; there may be no loose pair to look at now
    looked_from.clear();
  }
  load_rows(step);
  if (!debris_pairs.empty())
    find_near_pairs();
  if (parameters.bond.damping > 0.)
    add_pair_loads<true>(step);
  else
    add_pair_loads<false>(step);
  store_forces();
}

template <int dim>
template <bool damped>
void RockBondLoop<dim>::add_pair_loads(bool step)
{
  for (const int k : near_pairs)
    contact<damped>(debris_pairs[k], step, false);
  // After the contacts: what breaks becomes one and has its loads already.
  if (intact.template add_loads<damped>(rows, parameters.bond, lmp.neighbor->contactDistanceFactor, step,
                                        [this](const auto &bond) { this->template break_bond<damped>(bond); }))
    overstretched = true;
}

template <int dim>
typename RockBondLoop<dim>::OrderedPair RockBondLoop<dim>::ordered(int i, int j) const
{
  const BondEnd first{rows[i].radius, rows[i].weighted_radius}, second{rows[j].radius, rows[j].weighted_radius};
  const double weight = bond_weight(first, second), rolling = rolling_resistance(first, second);
  if (j < lmp.atom->nlocal)
    return {i, j, 1., 1., weight, rolling};
  if (lmp.atom->tag[i] < lmp.atom->tag[j])
    return {i, j, 1., 0.5, weight, rolling};
  return {j, i, -1., 0.5, weight, rolling};
}

template <int dim>
typename RockBondLoop<dim>::DebrisPair RockBondLoop<dim>::loose(const OrderedPair &pair, PairHistory &history, int &flag) const
{
  const double radii = rows[pair.first].radius + rows[pair.second].radius;
  return {pair, law::contact_length(radii, history.rest_length), viscosity(pair), &history, &flag};
}

template <int dim>
law::Pair<dim> RockBondLoop<dim>::geometry(const OrderedPair &pair) const
{
  const Row &first = rows[pair.first], &second = rows[pair.second];
  return law::make_pair<dim>(first.position, second.position, first.radius, second.radius);
}

template <int dim>
law::Pair<dim> RockBondLoop<dim>::bond_geometry(const OrderedPair &pair) const
{
  const Row &first = rows[pair.first], &second = rows[pair.second];
  return law::make_pair<dim>(first.position, second.position, first.weighted_radius, second.weighted_radius);
}

template <int dim>
std::array<law::Vector<dim>, 2> RockBondLoop<dim>::turned_normals(const OrderedPair &pair, const PairHistory &history) const
{
  const Vector normal = pair.sign * vector<dim>(history.vector);
  return {{rows[pair.first].turn() * normal, rows[pair.second].turn() * normal}};
}

template <int dim>
law::BondStrain<dim> RockBondLoop<dim>::bond_strain(const OrderedPair &pair, const PairHistory &history) const
{
  const auto [of_first, of_second] = turned_normals(pair, history);
  return law::bond_strain<dim>(bond_geometry(pair), history.rest_length, of_first, of_second);
}

template <int dim>
double RockBondLoop<dim>::bond_power(const OrderedPair &pair, const law::BondStrain<dim> &strain,
                                     const PairHistory &history) const
{
  const Row &first = rows[pair.first], &second = rows[pair.second];
  const auto [of_first, of_second] = turned_normals(pair, history);
  const auto load =
    law::bond_load<dim>(bond_geometry(pair), strain, history.rest_length, of_first, of_second, parameters.bond, pair.weight);
  const auto rolling = law::rolling_torque<dim>(pair.rolling, history.rest_length, of_first, of_second, parameters.bond);
  return load.force.dot(first.velocity - second.velocity) + load.torque_first.dot(first.spin) +
         load.torque_second.dot(second.spin) + rolling.dot(first.spin - second.spin);
}

template <int dim>
double RockBondLoop<dim>::bond_energy(const OrderedPair &pair, const law::BondStrain<dim> &strain,
                                      const PairHistory &history) const
{
  const auto [of_first, of_second] = turned_normals(pair, history);
  return pair.weight * law::bond_energy<dim>(strain, parameters.bond) +
         law::rolling_energy<dim>(pair.rolling, history.rest_length, of_first, of_second, parameters.bond);
}

template <int dim>
double RockBondLoop<dim>::viscosity(const OrderedPair &pair) const
{
  return law::viscosity(parameters.bond.damping, rows[pair.first].mass, rows[pair.second].mass,
                        pair.weight * parameters.bond.k_n);
}

namespace
{
/// The load on a row and its partner. Ghosts are loaded, too: nobody reads it and the loop has no branch.
template <int dim>
void add(ParticleRow<dim> &first, ParticleRow<dim> &second, const law::PairLoad<dim> &load)
{
  first.force += load.force;
  second.force -= load.force;
  first.torque += load.torque_first;
  second.torque += load.torque_second;
}
template <int dim>
void add_damping(ParticleRow<dim> &first, ParticleRow<dim> &second, const law::PairLoad<dim> &load)
{
  first.damping_force += load.force;
  second.damping_force -= load.force;
  first.damping_torque += load.torque_first;
  second.damping_torque += load.torque_second;
}
} // namespace

/// Contact without a bond: unilateral, with Coulomb friction.
template <int dim>
template <bool damped>
typename RockBondLoop<dim>::ContactSprings RockBondLoop<dim>::contact(const DebrisPair &loose, bool step, bool just_broken)
{
  const OrderedPair &pair = loose.pair;
  Row &first = rows[pair.first], &second = rows[pair.second];
  PairHistory &history = *loose.history;
  const BondParameters &bond = parameters.bond;
  auto stored_spring = vector<dim>(history.vector);
  if ((second.position - first.position).squaredNorm() >= loose.length * loose.length)
  {
    if (step && *loose.flag)
    {
      if (!just_broken)
        dissipation.friction += 0.5 * pair.share * pair.weight * bond.k_t * stored_spring.squaredNorm();
      stored_spring.setZero();
      *loose.flag = history.state == PairHistory::broken; // an open pair that was never bonded has nothing to remember
    }
    return {};
  }

  const auto geometry = this->geometry(pair);
  const Vector &normal = geometry.normal;
  const double k_n = pair.weight * bond.k_n, k_t = pair.weight * bond.k_t;
  const Vector v = law::contact_velocity<dim>(geometry, first.velocity, second.velocity, first.spin, second.spin);
  const Vector v_t = v - normal.dot(v) * normal;
  const double c = loose.viscosity;
  const double c_t = damped ? c * std::sqrt(bond.k_t / bond.k_n) : 0.;

  const double overlap = loose.length - geometry.distance;
  const double push = std::max(0., k_n * overlap - c * normal.dot(v)); // damping must not pull
  const Vector spring = law::in_contact_plane<dim>(pair.sign * stored_spring, normal);
  const Vector trial = step && !just_broken ? Vector(spring + parameters.time_step * v_t) : spring;
  const auto friction = law::coulomb<dim>(trial, k_t, push, bond.friction, c_t * v_t);

  const Vector force = k_t * friction.spring - k_n * overlap * normal;
  add(first, second, law::contact_point_load<dim>(geometry, force));
  if constexpr (damped)
  {
    const Vector viscous = (k_n * overlap - push) * normal + (friction.force - k_t * friction.spring);
    add_damping(first, second, law::contact_point_load<dim>(geometry, viscous));
  }
  if (step)
  {
    stored_spring = pair.sign * friction.spring;
    *loose.flag = 1;
    if (!just_broken) // work of the mean force of the step on the slip
      dissipation.friction += 0.5 * pair.share * k_t * (spring + friction.spring).dot(trial - friction.spring);
  }
  return {0.5 * (k_n * overlap * overlap + k_t * friction.spring.squaredNorm()), -force.dot(v)};
}

/// The bond becomes a contact that starts with its shear; what that cannot carry is released. The bond has stretched to here
/// without the force that it would have at this end of the step: that half of the work was not put in and is not released.
template <int dim>
template <bool damped>
void RockBondLoop<dim>::break_bond(const typename IntactBonds<dim>::Failing &bond)
{
  const auto [i, n] = bond.place;
  const int j = gran.list->firstneigh[i][n] & NEIGHMASK;
  PairHistory &history = reinterpret_cast<PairHistory *>(gran.listgranhistory->firstdouble[i])[n];
  const OrderedPair pair = ordered(i, j);
  const auto geometry = this->geometry(pair);
  const auto strain = bond_strain(pair, history);
  const double power_of_bond = bond_power(pair, strain, history), energy = bond_energy(pair, strain, history);

  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  position.head<dim>() = rows[pair.first].position + geometry.share_first * geometry.distance * geometry.normal;
  record_break(i, j, bond.failure == law::Failure::shear, position);
  history.state = PairHistory::broken;
  Eigen::Map<Eigen::Vector3d>(history.vector).setZero();
  vector<dim>(history.vector) = pair.sign * strain.shear;
  near_pairs.push_back(static_cast<int>(debris_pairs.size()));
  debris_pairs.push_back(loose(pair, history, gran.listgranhistory->firstneigh[i][n]));
  const ContactSprings left = contact<damped>(debris_pairs.back(), true, true);
  const double missing = 0.5 * parameters.time_step * (power_of_bond - left.power);
  dissipation.released += pair.share * (energy - left.energy + missing);
}

namespace
{
/// Arrays of LIGGGHTS from the first of some particles on.
struct Motions
{
  double *force, *torque;
  const double *velocity, *spin, *mass, *radius;
};

/// One half of local damping, opposed to the velocity on the step and in proportion to the load; returns the power of all
/// damping. @param per_inertia acceleration per load
template <int n>
Lanes damp_load(double factor, double half_step, const Lanes (&velocity)[n], const Lanes &per_inertia,
                const Lanes (&pair_damping)[n], Lanes (&load)[n])
{
  Lanes before[n], speed2 = 1e-200, load2 = 0.; // nothing at rest is damped
  for (int c = 0; c < n; ++c)
  {
    before[c] = velocity[c] + half_step * per_inertia * load[c];
    speed2 += before[c] * before[c];
    load2 += load[c] * load[c];
  }
  const Lanes viscosity = factor * sqrt(load2 / speed2);
  Lanes power = 0.;
  for (int c = 0; c < n; ++c)
  {
    const Lanes extra = -viscosity * before[c];
    load[c] += extra;
    power += (pair_damping[c] + extra) * (velocity[c] + half_step * per_inertia * load[c]);
  }
  return power;
}

template <int dim>
double damp_four(double factor, double half_step, const Motions &particles, const Load<dim> *viscous)
{
  constexpr int turns = dim == 2 ? 1 : 3;
  Lanes mass, radius, force[3], torque[3], velocity[3], spin[3], pair_force[dim], pair_torque[turns];
  std::memcpy(&mass.v, particles.mass, sizeof mass);
  std::memcpy(&radius.v, particles.radius, sizeof radius);
  load_vectors(particles.force, force[0], force[1], force[2]);
  load_vectors(particles.torque, torque[0], torque[1], torque[2]);
  load_vectors(particles.velocity, velocity[0], velocity[1], velocity[2]);
  load_vectors(particles.spin, spin[0], spin[1], spin[2]);
  for (int lane = 0; lane < Lanes::size; ++lane)
  {
    for (int c = 0; c < dim; ++c)
      pair_force[c].set(lane, viscous[lane].force[c]);
    for (int c = 0; c < turns; ++c)
      pair_torque[c].set(lane, viscous[lane].torque[c]);
  }
  const Lanes per_mass = 1. / mass, per_inertia = per_mass / (inertia_factor<dim> * radius * radius);
  Lanes power;
  if constexpr (dim == 2)
  {
    Lanes in_plane[] = {force[0], force[1]}, about_z[] = {torque[2]};
    const Lanes velocity_in_plane[] = {velocity[0], velocity[1]}, spin_about_z[] = {spin[2]};
    power = damp_load<2>(factor, half_step, velocity_in_plane, per_mass, pair_force, in_plane) +
            damp_load<1>(factor, half_step, spin_about_z, per_inertia, pair_torque, about_z);
    force[0] = in_plane[0], force[1] = in_plane[1], torque[2] = about_z[0];
  }
  else
    power = damp_load<3>(factor, half_step, velocity, per_mass, pair_force, force) +
            damp_load<3>(factor, half_step, spin, per_inertia, pair_torque, torque);
  store_vectors(particles.force, force[0], force[1], force[2]);
  store_vectors(particles.torque, torque[0], torque[1], torque[2]);
  return (power[0] + power[1]) + (power[2] + power[3]);
}
} // namespace

template <int dim>
void RockBondLoop<dim>::damp(bool step)
{
  const double factor = parameters.local_damping;
  if (factor == 0. && (parameters.bond.damping == 0. || !step))
    return;
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const double half_step = step ? 0.5 * parameters.time_step : 0.; // at setup the velocities are on the step already
  double power = 0.;
  for (int i = 0; i < atom.nlocal; i += Lanes::size)
  {
    const int n = std::min(Lanes::size, atom.nlocal - i);
    if (n == Lanes::size)
      power += damp_four<dim>(
        factor, half_step, {atom.f[i], atom.torque[i], atom.v[i], atom.omega[i], &atom.rmass[i], &atom.radius[i]}, &viscous[i]);
    else
    {
      // The last ones, filled up with particles that nothing acts on.
      double f[12] = {}, torque[12] = {}, v[12] = {}, omega[12] = {}, mass[] = {1., 1., 1., 1.}, radius[] = {1., 1., 1., 1.};
      Load<dim> pair_damping[Lanes::size];
      for (Load<dim> &load : pair_damping)
        load = {law::Vector<dim>::Zero(), law::Spin<dim>::Zero()};
      const auto copy = [&](const double *from, double *to, int components) { std::copy(from, from + components * n, to); };
      copy(atom.f[i], f, 3);
      copy(atom.torque[i], torque, 3);
      copy(atom.v[i], v, 3);
      copy(atom.omega[i], omega, 3);
      copy(&atom.rmass[i], mass, 1);
      copy(&atom.radius[i], radius, 1);
      std::copy(&viscous[i], &viscous[i] + n, pair_damping);
      power += damp_four<dim>(factor, half_step, {f, torque, v, omega, mass, radius}, pair_damping);
      std::copy(f, f + 3 * n, atom.f[i]);
      std::copy(torque, torque + 3 * n, atom.torque[i]);
    }
  }
  if (step)
    dissipation.damping -= parameters.time_step * power;
}

template <int dim>
double RockBondLoop<dim>::elastic_energy()
{
  double energy = 0.;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      const OrderedPair pair = ordered(i, j);
      const BondParameters &bond = parameters.bond;
      if (history.state == PairHistory::intact)
        energy += pair.share * bond_energy(pair, bond_strain(pair, history), history);
      else if (const double overlap = loose(pair, history, flag).length - geometry(pair).distance; overlap > 0.)
        energy += 0.5 * pair.share * pair.weight *
                  (bond.k_n * overlap * overlap + bond.k_t * vector<dim>(history.vector).squaredNorm());
    });
  return energy;
}

template <int dim>
std::vector<ActiveBond> RockBondLoop<dim>::bonds(const std::vector<char> &target)
{
  std::vector<ActiveBond> bonds;
  bonds.reserve(target.empty() ? intact.size() : intact.size() / 4);
  const int *tag = lmp.atom->tag;
  for_each_pair(
    [&](int i, int j, const PairHistory &history, int)
    {
      if (history.state != PairHistory::intact || (j >= lmp.atom->nlocal && tag[i] > tag[j]))
        return;
      if (!target.empty() && !target[tag[i] - 1] && !target[tag[j] - 1])
        return;
      OrderedPair pair = ordered(i, j);
      if (tag[i] > tag[j])
        pair = {j, i, -pair.sign, pair.share, pair.weight, pair.rolling};
      const auto strain = bond_strain(pair, history);
      const int a = pair.first, b = pair.second;
      ActiveBond bond{tag[a] - 1,
                      tag[b] - 1,
                      vector<3>(lmp.atom->x[a]),
                      vector<3>(lmp.atom->x[b]),
                      parameters.bond.k_n * strain.elongation,
                      parameters.bond.k_t * strain.shear.norm()};
      vector<dim>(bond.force.data()) = bond.normal_force * geometry(pair).normal + parameters.bond.k_t * strain.shear;
      bonds.push_back(bond);
    });
  return bonds;
}

template class RockBondLoop<2>;
template class RockBondLoop<3>;
} // namespace kerf::dem
