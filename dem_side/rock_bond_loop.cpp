// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/rock_bond_loop.h"

#include <atom.h>
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
Eigen::Map<law::Spin<dim>> spin(double *v)
{
  return Eigen::Map<law::Spin<dim>>(v + (dim == 2 ? 2 : 0));
}
template <int dim>
constexpr double inertia_factor = dim == 2 ? 0.5 : 0.4; // J = factor m r^2 of a disc, a sphere

/// Turns the quaternion q by the constant rate w over dt: q <- exp(w dt / 2) q.
template <int dim>
void turn(double *q, const double *w, double dt)
{
  const Eigen::Vector3d half = dim == 2 ? Eigen::Vector3d(0., 0., 0.5 * dt * w[2]) : Eigen::Vector3d(0.5 * dt * vector<3>(w));
  const double square = half.squaredNorm();
  double cosine, sinc;
  if (square < 1e-3) // remainders of the series are below 1e-15
  {
    cosine = 1. - square / 2. * (1. - square / 12. * (1. - square / 30.));
    sinc = 1. - square / 6. * (1. - square / 20. * (1. - square / 42.));
  }
  else
  {
    const double angle = std::sqrt(square);
    cosine = std::cos(angle);
    sinc = std::sin(angle) / angle;
  }
  if constexpr (dim == 2)
  {
    const double s = sinc * half.z();
    const double real = cosine * q[0] - s * q[3], z = cosine * q[3] + s * q[0];
    const double unit = 1.5 - 0.5 * (real * real + z * z); // Newton step against the drift of the norm by round-off
    q[0] = unit * real;
    q[3] = unit * z;
  }
  else
  {
    const Eigen::Quaterniond now(q[0], q[1], q[2], q[3]), by(cosine, sinc * half.x(), sinc * half.y(), sinc * half.z());
    const Eigen::Vector4d next = (by * now).coeffs();
    const double unit = 1.5 - 0.5 * next.squaredNorm();
    q[0] = unit * next[3];
    vector<3>(q + 1) = unit * next.template head<3>();
  }
}
} // namespace

template <int dim>
void RockBondLoop<dim>::load_rows(bool step)
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const int n = atom.nlocal + atom.nghost;
  rows.resize(n);
  double *q = rotation();
  const double *weights = weight();
  for (int i = 0; i < n; ++i)
  {
    if (step)
      turn<dim>(q + 4 * i, atom.omega[i], parameters.time_step);
    Row &row = rows[i];
    row.position = vector<dim>(atom.x[i]);
    row.velocity = vector<dim>(atom.v[i]);
    row.spin = spin<dim>(atom.omega[i]);
    row.turn.set(q + 4 * i);
    row.radius = atom.radius[i];
    row.mass = atom.rmass[i];
    row.weight = weights[i];
    row.force.setZero();
    row.torque.setZero();
    row.damping_force.setZero();
    row.damping_torque.setZero();
  }
}

template <int dim>
void RockBondLoop<dim>::store_forces()
{
  LAMMPS_NS::Atom &atom = *lmp.atom;
  for (int i = 0; i < atom.nlocal; ++i)
  {
    vector<dim>(atom.f[i]) += rows[i].force;
    spin<dim>(atom.torque[i]) += rows[i].torque;
  }
}

template <int dim>
void RockBondLoop<dim>::pair_forces(bool step)
{
  load_rows(step);
  if (parameters.bond.damping > 0.)
    visit_pairs<true>(step);
  else
    visit_pairs<false>(step);
  store_forces();
}

template <int dim>
typename RockBondLoop<dim>::OrderedPair RockBondLoop<dim>::ordered(int i, int j)
{
  const double weight = 0.5 * (rows[i].weight + rows[j].weight);
  if (j < lmp.atom->nlocal)
    return {rows[i], rows[j], 1., 1., weight};
  if (lmp.atom->tag[i] < lmp.atom->tag[j])
    return {rows[i], rows[j], 1., 0.5, weight};
  return {rows[j], rows[i], -1., 0.5, weight};
}

namespace
{
/// The load on a row and its partner. Ghosts are loaded, too: nobody reads it and the loop has no branch.
template <int dim>
[[gnu::always_inline]] inline void add(ParticleRow<dim> &first, ParticleRow<dim> &second, const law::PairLoad<dim> &load)
{
  first.force += load.force;
  second.force -= load.force;
  first.torque += load.torque_first;
  second.torque += load.torque_second;
}
template <int dim>
[[gnu::always_inline]] inline void add_damping(ParticleRow<dim> &first, ParticleRow<dim> &second,
                                               const law::PairLoad<dim> &load)
{
  add(first, second, load);
  first.damping_force += load.force;
  second.damping_force -= load.force;
  first.damping_torque += load.torque_first;
  second.damping_torque += load.torque_second;
}
} // namespace

template <int dim>
template <bool damped>
void RockBondLoop<dim>::visit_pairs(bool step)
{
  const double reach = lmp.neighbor->contactDistanceFactor;
  const BondParameters &bond = parameters.bond;
  const double tangential_viscosity = std::sqrt(bond.k_t / bond.k_n);
  for_each_pair([&](int i, int j, PairHistory &history, int &flag) __attribute__((always_inline)) {
    const OrderedPair pair = ordered(i, j);
    Row &first = pair.first, &second = pair.second;
    if (history.state != PairHistory::intact)
    {
      contact<damped>(pair, history, flag, step, false);
      return;
    }
    const auto geometry = law::make_pair<dim>(first.position, second.position, first.radius, second.radius);
    const Vector normal = pair.sign * vector<dim>(history.vector);
    const Vector turned_first = first.turn * normal, turned_second = second.turn * normal;
    const auto strain = law::bond_strain<dim>(geometry, history.rest_length, turned_first, turned_second);
    if (step)
    {
      const law::Failure failure = law::bond_failure<dim>(strain, bond);
      if (failure != law::Failure::none)
      {
        Eigen::Vector3d position = Eigen::Vector3d::Zero();
        position.head<dim>() = first.position + geometry.share_first * geometry.distance * geometry.normal;
        record_break(i, j, failure == law::Failure::shear, position);
        break_bond<damped>(pair, strain, history, flag);
        return;
      }
    }
    if (!(geometry.distance < reach * (first.radius + second.radius)))
      overstretched = true;

    auto load = law::bond_load<dim>(geometry, strain, history.rest_length, turned_first, turned_second, bond);
    load.force *= pair.weight;
    load.torque_first *= pair.weight;
    load.torque_second *= pair.weight;
    add(first, second, load);
    if constexpr (damped)
    {
      const Vector v = law::contact_velocity<dim>(geometry, first.velocity, second.velocity, first.spin, second.spin);
      const double c = law::viscosity(bond.damping, first.mass, second.mass, pair.weight * bond.k_n);
      const double c_t = tangential_viscosity * c;
      const Vector force = c_t * v + (c - c_t) * geometry.normal.dot(v) * geometry.normal;
      add_damping(first, second, law::contact_point_load<dim>(geometry, force));
    }
  });
}

/// Contact without a bond: unilateral, with Coulomb friction. Returns its elastic energy at the end (weighted) [J].
template <int dim>
template <bool damped>
double RockBondLoop<dim>::contact(const OrderedPair &pair, PairHistory &history, int &flag, bool step, bool just_broken)
{
  Row &first = pair.first, &second = pair.second;
  const BondParameters &bond = parameters.bond;
  const double length = law::contact_length(first.radius + second.radius, history.rest_length);
  auto stored_spring = vector<dim>(history.vector);
  if ((second.position - first.position).squaredNorm() >= length * length)
  {
    if (step && flag)
    {
      if (!just_broken)
        dissipation.friction += 0.5 * pair.share * pair.weight * bond.k_t * stored_spring.squaredNorm();
      stored_spring.setZero();
      flag = history.state == PairHistory::broken; // an open pair that was never bonded has nothing to remember
    }
    return 0.;
  }

  const auto geometry = law::make_pair<dim>(first.position, second.position, first.radius, second.radius);
  const Vector &normal = geometry.normal;
  const double k_n = pair.weight * bond.k_n, k_t = pair.weight * bond.k_t;
  const Vector v = law::contact_velocity<dim>(geometry, first.velocity, second.velocity, first.spin, second.spin);
  const Vector v_t = v - normal.dot(v) * normal;
  const double c = damped ? law::viscosity(bond.damping, first.mass, second.mass, k_n) : 0.;
  const double c_t = damped ? c * std::sqrt(bond.k_t / bond.k_n) : 0.;

  const double overlap = length - geometry.distance;
  const double push = std::max(0., k_n * overlap - c * normal.dot(v)); // damping must not pull
  const Vector spring = law::in_contact_plane<dim>(pair.sign * stored_spring, normal);
  const Vector trial = step && !just_broken ? Vector(spring + parameters.time_step * v_t) : spring;
  const auto friction = law::coulomb<dim>(trial, k_t, push, bond.friction, c_t * v_t);

  const Vector force = friction.force - push * normal;
  add(first, second, law::contact_point_load<dim>(geometry, force));
  if constexpr (damped)
  {
    const Vector viscous = (k_n * overlap - push) * normal + (friction.force - k_t * friction.spring);
    const auto load = law::contact_point_load<dim>(geometry, viscous);
    first.damping_force += load.force;
    second.damping_force -= load.force;
    first.damping_torque += load.torque_first;
    second.damping_torque += load.torque_second;
  }
  if (step)
  {
    stored_spring = pair.sign * friction.spring;
    flag = 1;
    if (!just_broken) // work of the mean force of the step on the slip
      dissipation.friction += 0.5 * pair.share * k_t * (spring + friction.spring).dot(trial - friction.spring);
  }
  return 0.5 * (k_n * overlap * overlap + k_t * friction.spring.squaredNorm());
}

/// The bond becomes a contact that starts with its shear; what that cannot carry is released.
template <int dim>
template <bool damped>
void RockBondLoop<dim>::break_bond(const OrderedPair &pair, const law::BondStrain<dim> &strain, PairHistory &history, int &flag)
{
  history.state = PairHistory::broken;
  Eigen::Map<Eigen::Vector3d>(history.vector).setZero();
  vector<dim>(history.vector) = pair.sign * strain.shear;
  const double left = contact<damped>(pair, history, flag, true, true);
  dissipation.released += pair.share * (pair.weight * law::bond_energy<dim>(strain, parameters.bond) - left);
}

template <int dim>
void RockBondLoop<dim>::damp(bool step)
{
  const double factor = parameters.local_damping;
  if (factor == 0. && (parameters.bond.damping == 0. || !step))
    return;
  LAMMPS_NS::Atom &atom = *lmp.atom;
  const double half_step = step ? 0.5 * parameters.time_step : 0.; // at setup the velocities are on the step already
  double power = 0.;
  // One half of local damping (F, v) or (T, w) with the acceleration per force; returns the power of all damping.
  const auto damp_one = [&](auto load, const auto &velocity, const auto &pair_damping, double per_inertia)
  {
    const auto before = (velocity + half_step * per_inertia * load).eval();
    const double speed = before.norm();
    auto damping = pair_damping.eval();
    if (factor > 0. && speed > 0.)
    {
      const auto extra = (-factor * load.norm() / speed * before).eval();
      load += extra;
      damping += extra;
    }
    return damping.dot(velocity + half_step * per_inertia * load);
  };
  for (int i = 0; i < atom.nlocal; ++i)
  {
    const Row &row = rows[i];
    const double per_mass = 1. / row.mass;
    power += damp_one(vector<dim>(atom.f[i]), vector<dim>(atom.v[i]), row.damping_force, per_mass);
    power += damp_one(spin<dim>(atom.torque[i]), spin<dim>(atom.omega[i]), row.damping_torque,
                      per_mass / (inertia_factor<dim> * row.radius * row.radius));
  }
  if (step)
    dissipation.damping -= parameters.time_step * power;
}

template <int dim>
double RockBondLoop<dim>::elastic_energy()
{
  double energy = 0.;
  for_each_pair(
    [&](int i, int j, const PairHistory &history, int)
    {
      const OrderedPair pair = ordered(i, j);
      const Row &first = pair.first, &second = pair.second;
      const auto geometry = law::make_pair<dim>(first.position, second.position, first.radius, second.radius);
      const Vector stored = pair.sign * vector<dim>(history.vector);
      if (history.state == PairHistory::intact)
      {
        const auto strain = law::bond_strain<dim>(geometry, history.rest_length, first.turn * stored, second.turn * stored);
        energy += pair.share * pair.weight * law::bond_energy<dim>(strain, parameters.bond);
        return;
      }
      const double overlap = law::contact_length(first.radius + second.radius, history.rest_length) - geometry.distance;
      if (overlap > 0.)
        energy += 0.5 * pair.share * pair.weight *
                  (parameters.bond.k_n * overlap * overlap + parameters.bond.k_t * stored.squaredNorm());
    });
  return energy;
}

template <int dim>
std::vector<ActiveBond> RockBondLoop<dim>::bonds()
{
  std::vector<ActiveBond> bonds;
  const int *tag = lmp.atom->tag;
  for_each_pair(
    [&](int i, int j, const PairHistory &history, int)
    {
      if (history.state != PairHistory::intact || (j >= lmp.atom->nlocal && tag[i] > tag[j]))
        return;
      const int a = tag[i] < tag[j] ? i : j, b = tag[i] < tag[j] ? j : i;
      const Vector normal = (a == i ? 1. : -1.) * vector<dim>(history.vector);
      const auto geometry = law::make_pair<dim>(rows[a].position, rows[b].position, rows[a].radius, rows[b].radius);
      const auto strain = law::bond_strain<dim>(geometry, history.rest_length, rows[a].turn * normal, rows[b].turn * normal);
      bonds.push_back({tag[a] - 1, tag[b] - 1, vector<3>(lmp.atom->x[a]), vector<3>(lmp.atom->x[b]),
                       parameters.bond.k_n * strain.elongation, parameters.bond.k_t * strain.shear.norm()});
    });
  return bonds;
}

template class RockBondLoop<2>;
template class RockBondLoop<3>;
} // namespace kerf::dem
