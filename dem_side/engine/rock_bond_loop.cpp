// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/engine/rock_bond_loop.h"

#include "dem_side/bond/bond_weight.h"
#include "dem_side/engine/particle_rotation.h"

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
} // namespace

/// Data that change only when the lists are built.
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
        debris_pairs.push_back(debris_pair(pair, history, flag));
    });
  intact.assign(listed);
}

/// Reads positions and velocities and advances the rotations. The loads are zero since store_forces().
template <int dim>
void RockBondLoop<dim>::load_rows(bool step)
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const int n = atom.nlocal + atom.nghost;
  double *rotations = rotation();
  // LIGGGHTS' arrays are contiguous. Reading its pointers to their rows would cost memory bandwidth.
  const double *x = n > 0 ? atom.x[0] : nullptr, *v = n > 0 ? atom.v[0] : nullptr, *omega = n > 0 ? atom.omega[0] : nullptr;
  largest_square_move = 0.;
  for (int begin = 0; begin < n; begin += SimdPack::size)
  {
    const int count = std::min(n - begin, SimdPack::size);
    // All particles go through the same instructions, because a ghost must rotate like its owner to the last bit.
    SimdPack q[4];
    law::Spin<dim, SimdPack> w;
    for (int lane = 0; lane < SimdPack::size; ++lane)
    {
      const int i = std::min(begin + lane, n - 1);
      std::memcpy(&q[lane].v, rotations + 4 * i, sizeof(SimdPack));
      const auto rate = spin<dim>(omega + 3 * i);
      for (int c = 0; c < w.size(); ++c)
        w[c].set(lane, rate[c]);
    }
    transpose(q[0], q[1], q[2], q[3]);
    if (step)
    {
      rotate<dim>(q, w, parameters.time_step);
      SimdPack rotated[] = {q[0], q[1], q[2], q[3]};
      transpose(rotated[0], rotated[1], rotated[2], rotated[3]);
      std::memcpy(rotations + 4 * begin, rotated, count * sizeof(SimdPack));
    }
    set_rotation(&rows[begin], count, q);
    for (int i = begin; i < begin + count; ++i)
    {
      Row &row = rows[i];
      row.position = vector<dim>(x + 3 * i);
      row.velocity = vector<dim>(v + 3 * i);
      row.spin = spin<dim>(omega + 3 * i);
    }
    if (!debris_pairs.empty() && !searched_at.empty())
      for (int i = begin; i < begin + count; ++i)
        largest_square_move = std::max(largest_square_move, (rows[i].position - searched_at[i]).squaredNorm());
  }
}

template <int dim>
void RockBondLoop<dim>::find_near_pairs()
{
  const double gap =
    0.05 * parameters.packing->mean_diameter; // results do not depend on it: a wider gap needs fewer searches of more pairs
  if (!searched_at.empty() && largest_square_move < 0.25 * gap * gap)
    return;
  near_pairs.clear();
  for (int k = 0; k < static_cast<int>(debris_pairs.size()); ++k)
  {
    const DebrisPair &debris = debris_pairs[k];
    const double distance = (rows[debris.pair.second].position - rows[debris.pair.first].position).norm();
    // A contact that has opened must still reset its spring.
    if (distance < debris.length + gap || !vector<dim>(debris.history->vector).isZero(0.))
      near_pairs.push_back(k);
  }
  searched_at.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i)
    searched_at[i] = rows[i].position;
}

/// Moves the loads from the rows to LIGGGHTS' arrays.
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
    near_pairs.clear(); // they belong to the old lists; find_near_pairs() is not called without debris pairs
    searched_at.clear();
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
  // After the contacts, because a bond that breaks becomes a contact and computes its loads at once.
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
typename RockBondLoop<dim>::DebrisPair RockBondLoop<dim>::debris_pair(const OrderedPair &pair, PairHistory &history,
                                                                      int &flag) const
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
std::array<law::Vector<dim>, 2> RockBondLoop<dim>::rotated_normals(const OrderedPair &pair, const PairHistory &history) const
{
  const Vector normal = pair.sign * vector<dim>(history.vector);
  return {{rows[pair.first].turn() * normal, rows[pair.second].turn() * normal}};
}

template <int dim>
law::BondStrain<dim> RockBondLoop<dim>::bond_strain(const OrderedPair &pair, const PairHistory &history) const
{
  const auto [of_first, of_second] = rotated_normals(pair, history);
  return law::bond_strain<dim>(bond_geometry(pair), history.rest_length, of_first, of_second);
}

template <int dim>
double RockBondLoop<dim>::bond_power(const OrderedPair &pair, const law::BondStrain<dim> &strain,
                                     const PairHistory &history) const
{
  const Row &first = rows[pair.first], &second = rows[pair.second];
  const auto [of_first, of_second] = rotated_normals(pair, history);
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
  const auto [of_first, of_second] = rotated_normals(pair, history);
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
/// Adds a load to a row and its partner. Ghosts get loads, too, which nothing reads; this saves a branch in the loop.
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

/// Contact without a bond: unilateral, with Coulomb friction. Theory (3.11), (3.12).
template <int dim>
template <bool damped>
typename RockBondLoop<dim>::ContactSprings RockBondLoop<dim>::contact(const DebrisPair &debris, bool step, bool just_broken)
{
  const OrderedPair &pair = debris.pair;
  Row &first = rows[pair.first], &second = rows[pair.second];
  PairHistory &history = *debris.history;
  const BondParameters &bond = parameters.bond;
  auto stored_spring = vector<dim>(history.vector);
  if ((second.position - first.position).squaredNorm() >= debris.length * debris.length)
  {
    if (step && *debris.flag)
    {
      if (!just_broken)
        dissipation.friction += 0.5 * pair.share * pair.weight * bond.k_t * stored_spring.squaredNorm();
      stored_spring.setZero();
      *debris.flag = history.state == PairHistory::broken; // an open pair that was never bonded has no state
    }
    return {};
  }

  const auto geometry = this->geometry(pair);
  const Vector &normal = geometry.normal;
  const double k_n = pair.weight * bond.k_n, k_t = pair.weight * bond.k_t;
  const Vector v = law::contact_velocity<dim>(geometry, first.velocity, second.velocity, first.spin, second.spin);
  const Vector v_t = v - normal.dot(v) * normal;
  const double c = debris.viscosity;
  const double c_t = damped ? c * std::sqrt(bond.k_t / bond.k_n) : 0.;

  const double overlap = debris.length - geometry.distance;
  const double push = std::max(0., k_n * overlap - c * normal.dot(v)); // damping must not cause tension
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
    *debris.flag = 1;
    if (!just_broken) // work of the mean force of the step on the slip
      dissipation.friction += 0.5 * pair.share * k_t * (spring + friction.spring).dot(trial - friction.spring);
  }
  return {0.5 * (k_n * overlap * overlap + k_t * friction.spring.squaredNorm()), -force.dot(v)};
}

/// The bond becomes a contact whose tangential spring starts with the shear of the bond. The elastic energy that the contact
/// cannot hold is released. In this step the particles moved without the force that the bond would have at the end of the step.
/// By the trapezoidal rule half of the work of that force is missing in the bond, so it is not released either.
/// Theory (3.17).
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
  debris_pairs.push_back(debris_pair(pair, history, gran.listgranhistory->firstneigh[i][n]));
  const ContactSprings left = contact<damped>(debris_pairs.back(), true, true);
  const double missing = 0.5 * parameters.time_step * (power_of_bond - left.power);
  dissipation.released += pair.share * (energy - left.energy + missing);
}

template <int dim>
void RockBondLoop<dim>::damp(bool step)
{
  const double factor = parameters.local_damping;
  if (factor == 0. && (parameters.bond.damping == 0. || !step))
    return;
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const double half_step = step ? 0.5 * parameters.time_step : 0.; // at setup the velocities are those of the step already
  DampingPower<double> power = {0., 0.};
  const auto add = [&power](const DampingPower<double> &more)
  {
    power.at_step += more.at_step;
    power.half_back += more.half_back;
  };
  for (int i = 0; i < atom.nlocal; i += SimdPack::size)
  {
    const int n = std::min(SimdPack::size, atom.nlocal - i);
    if (n == SimdPack::size)
      add(damp_four<dim>(factor, half_step,
                         {atom.f[i], atom.torque[i], atom.v[i], atom.omega[i], &atom.rmass[i], &atom.radius[i]}, &viscous[i]));
    else
    {
      // The last particles, completed to four with particles without load.
      double f[12] = {}, torque[12] = {}, v[12] = {}, omega[12] = {}, mass[] = {1., 1., 1., 1.}, radius[] = {1., 1., 1., 1.};
      Load<dim> pair_damping[SimdPack::size];
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
      add(damp_four<dim>(factor, half_step, {f, torque, v, omega, mass, radius}, pair_damping));
      std::copy(f, f + 3 * n, atom.f[i]);
      std::copy(torque, torque + 3 * n, atom.torque[i]);
    }
  }
  if (!step)
    return;
  dissipation.damping -= parameters.time_step * power.at_step;
  damping_ahead = -parameters.time_step * (power.at_step - 0.5 * power.half_back);
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
      else if (const double overlap = debris_pair(pair, history, flag).length - geometry(pair).distance; overlap > 0.)
        energy += 0.5 * pair.share * pair.weight *
                  (bond.k_n * overlap * overlap + bond.k_t * vector<dim>(history.vector).squaredNorm());
    });
  return energy;
}

template <int dim>
void RockBondLoop<dim>::prepare_weights(const Eigen::VectorXd &new_weights, const std::vector<char> &leaves)
{
  const int *tag = lmp.atom->tag;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      if (leaves[tag[i] - 1] || leaves[tag[j] - 1])
        return;
      const OrderedPair pair = ordered(i, j);
      const auto end = [&](int k) { return bond_end(rows[k].radius, new_weights[tag[k] - 1]); };
      const BondEnd first = end(pair.first), second = end(pair.second);
      const double length = debris_pair(pair, history, flag).length, distance = geometry(pair).distance;
      if (history.state == PairHistory::intact)
      {
        const auto [of_first, of_second] = rotated_normals(pair, history);
        const auto now = bond_strain(pair, history);
        const auto then = law::bond_strain<dim>(
          law::make_pair<dim>(rows[pair.first].position, rows[pair.second].position, first.weighted, second.weighted),
          history.rest_length, of_first, of_second);
        if (!law::misfits<dim>(then, now, parameters.bond))
          return;
        dissipation.released += pair.share * bond_energy(pair, now, history);
        Eigen::Vector3d position = Eigen::Vector3d::Zero();
        position.head<dim>() = 0.5 * (rows[pair.first].position + rows[pair.second].position);
        record_break(i, j, true, position);
        history.state = PairHistory::broken;
        history.rest_length = std::min(length, distance); // starts without force, as a contact of new particles
        Eigen::Map<Eigen::Vector3d>(history.vector).setZero();
        flag = 1;
        return;
      }
      const double share = pair.weight / bond_weight(first, second);
      if (share >= 1. || distance >= length)
        return;
      history.rest_length = distance + share * (length - distance);
      vector<dim>(history.vector) *= share;
      flag = 1;
    });
}

template <int dim>
law::Vector<dim> RockBondLoop<dim>::present_force(const OrderedPair &pair, const PairHistory &history, double length,
                                                  double &energy) const
{
  const Row &first = rows[pair.first], &second = rows[pair.second];
  const BondParameters &bond = parameters.bond;
  const bool intact_bond = history.state == PairHistory::intact;
  const auto geometry = intact_bond ? bond_geometry(pair) : this->geometry(pair);
  const Vector v = law::contact_velocity<dim>(geometry, first.velocity, second.velocity, first.spin, second.spin);
  const Vector v_n = geometry.normal.dot(v) * geometry.normal;
  const double c = viscosity(pair), c_t = c * std::sqrt(bond.k_t / bond.k_n);
  if (intact_bond)
  {
    const auto strain = bond_strain(pair, history);
    const auto [of_first, of_second] = rotated_normals(pair, history);
    energy = bond_energy(pair, strain, history);
    return law::bond_load<dim>(geometry, strain, history.rest_length, of_first, of_second, bond, pair.weight).force + c * v_n +
           c_t * (v - v_n);
  }
  const double overlap = length - geometry.distance, k_n = pair.weight * bond.k_n, k_t = pair.weight * bond.k_t;
  const double push = std::max(0., k_n * overlap - c * geometry.normal.dot(v));
  const Vector spring = pair.sign * vector<dim>(history.vector);
  energy = 0.5 * (k_n * overlap * overlap + k_t * spring.squaredNorm());
  // The spring has been returned to Coulomb's limit already, so the law gives the force of the step again.
  return law::coulomb<dim>(spring, k_t, push, bond.friction, c_t * (v - v_n)).force - push * geometry.normal;
}

template <int dim>
std::vector<LoadedPair> RockBondLoop<dim>::loaded_pairs()
{
  std::vector<LoadedPair> pairs;
  for_each_pair(
    [&](int i, int j, PairHistory &history, int &flag)
    {
      const OrderedPair pair = ordered(i, j);
      const double length = debris_pair(pair, history, flag).length;
      if (history.state != PairHistory::intact && geometry(pair).distance >= length)
        return;
      LoadedPair loaded{i, j, 0., Eigen::Vector3d::Zero()};
      vector<dim>(loaded.force.data()) = (pair.first == i ? 1. : -1.) * present_force(pair, history, length, loaded.energy);
      pairs.push_back(loaded);
    });
  return pairs;
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
