// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/multiplier_constraint.h"

#include "coupler/gather.h"

#include <Eigen/Geometry>
#include <algorithm>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
/// Share of what the mean displacements are apart that is taken back in a step. The velocities are tied exactly, so only the
/// placing of new particles and forces that the coupler does not see, like local damping, take them apart.
constexpr double drift_share = 0.02;
} // namespace

/// A particle of the outermost row weighs d/(2 L_o). Springs of that share of k_n give way to its load by about the strain of a
/// diameter, and are a per cent of the stiffness of a particle that weighs one half.
MultiplierConstraint::Settings multiplier_settings(const Case &settings, double dt)
{
  MultiplierConstraint::Settings result;
  result.time_step = dt;
  result.relaxation = settings.fluctuation_relaxation;
  result.holding = 0.5 * settings.bond.k_n * settings.packing.mean_diameter / settings.overlap_width;
  return result;
}

double fluctuation_share(double weight, double share)
{
  return std::max(share, 1. - weight);
}

double holding_spring(const MultiplierConstraint::Settings &settings, double weight, double share, double mass)
{
  constexpr double share_of_step = 0.5; // of omega^2 dt^2, at most
  const double dt = settings.time_step;
  return fluctuation_share(weight, share) *
         std::min(settings.holding * (1. - weight) * (1. - weight), share_of_step * mass / (dt * dt));
}

MultiplierConstraint::MultiplierConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), links(packing, WindowNodes::all, settings.comm),
    work(settings.time_step, settings.comm)
{
  MPI_Comm_rank(settings.comm, &rank);
}

void MultiplierConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  links.set_particles(particles);
  blocked.clear();
  for (const TiedParticle &particle : particles)
    if (particle.blocked[0] || particle.blocked[1] || particle.blocked[2])
      blocked[particle.index] = particle.blocked;
}

/// Every rank builds the equations of all links and solves them: they are as many as the nodes of the overlap, and what each
/// rank adds to their right-hand side is a sum.
void MultiplierConstraint::build_equations(const dem::Particles &particles, const fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  const std::vector<OverlapLink> &list = links.links();
  inverse_mass.resize(3, list.size());
  c.resize(list.size());
  link_force.resize(list.size());
  spring.resize(list.size());
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    const int index = particles.index[list[k].particle];
    const int i = list[k].particle;
    c[k] = list[k].share * packing.volume(index);
    spring[k] = holding_spring(settings, particles.weight[i], list[k].share, particles.mass[i]);
    inverse_mass.col(k).setConstant(1. / particles.mass[list[k].particle]);
    if (const auto found = blocked.find(index); found != blocked.end())
      for (int axis = 0; axis < 3; ++axis)
        if (found->second[axis])
          inverse_mass(axis, k) = 0.;
  }

  constexpr int record = 5 + 2 * 8; // c, three inverse masses, number of nodes, nodes, shape functions
  std::vector<double> mine;
  mine.reserve(list.size() * record);
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    mine.insert(mine.end(), {c[k], inverse_mass(0, k), inverse_mass(1, k), inverse_mass(2, k), double(list[k].n)});
    mine.insert(mine.end(), list[k].node.begin(), list[k].node.end());
    mine.insert(mine.end(), list[k].N.begin(), list[k].N.end());
  }
  const std::vector<double> all = gather_all(mine, MPI_DOUBLE, settings.comm);
  const std::size_t n = all.size() / record;
  std::vector<int> nodes(8 * n);
  std::vector<MultiplierEquations::Row> rows(n);
  equations.clear();
  for (int axis = 0; axis < packing.dim; ++axis)
  {
    bool same_as_before = axis > 0;
    for (std::size_t k = 0; k < n; ++k)
    {
      const double *values = &all[k * record];
      same_as_before = same_as_before && values[1 + axis] == values[axis];
      rows[k].c = values[0];
      rows[k].inverse_mass = values[1 + axis];
      rows[k].n = static_cast<int>(values[4]);
      std::copy(values + 5, values + 13, &nodes[8 * k]);
      rows[k].node = &nodes[8 * k];
      rows[k].N = values + 13;
    }
    if (axis > 0)
      same_as_before = same_as_before && inverse_node_mass.row(axis) == inverse_node_mass.row(axis - 1);
    if (!same_as_before)
      equations.push_back(std::make_unique<MultiplierEquations>(rows, inverse_node_mass.row(axis)));
    equations_of_axis[axis] = static_cast<int>(equations.size()) - 1;
  }
}

void MultiplierConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (links.n_particles() == 0)
    return;
  work.begin(phase, particles, fem);
  if (links.update(particles, fem) == LinkChange::renewed)
    build_equations(particles, fem);
  fem.read_window(fem::NodalField::displacement, displacement);
  fem.read_window(fem::NodalField::velocity, velocity);
  hold_light_particles(particles, fem);
  fem.read_window(fem::NodalField::force, force);

  relax_fluctuations(particles);
  // In a step the hook sees v^{n-1/2} and the forces lead to v^{n+1/2}; after a setup half a step leads there.
  impose(phase == dem::Phase::step ? settings.time_step : 0.5 * settings.time_step, particles);
  add_couples(particles);
  fem.add_window_forces(node_force);
  work.end(node_force, velocity);
}

void MultiplierConstraint::hold_light_particles(dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  node_force.setZero(3, links.n_window());
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const Vector3d chi = links.displacement_gap(link, particles, displacement);
    particles.force.col(link.particle) -= spring[k] * chi; // along chi: no couple
    OverlapLinks::spread(link, spring[k] * chi, node_force);
    stored += 0.5 * spring[k] * chi.squaredNorm();
  }
  fem.add_window_forces(node_force);
}

/// f_i = -rho m_i/dt (v_i - sum_a N_a v_a), with its reaction on the nodes.
void MultiplierConstraint::relax_fluctuations(dem::Particles &particles)
{
  reaction.setZero(3, links.n_window());
  const double rate = settings.relaxation / settings.time_step;
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const int i = link.particle;
    link_force[k] = -rate * fluctuation_share(particles.weight[i], link.share) * particles.mass[i] *
                    OverlapLinks::gap(link, particles.velocity, velocity);
    particles.force.col(link.particle) += link_force[k];
    OverlapLinks::spread(link, -link_force[k], reaction);
  }
}

/// Finds the forces after which the mean velocities agree at the next half step, and adds them.
void MultiplierConstraint::impose(double tau, dem::Particles &particles)
{
  const int n = links.n_window();
  const std::vector<OverlapLink> &list = links.links();
  // What this rank's particles add: their rate, the gap, reaction of the relaxation.
  Eigen::MatrixXd sums = Eigen::MatrixXd::Zero(9, n);
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    const OverlapLink &link = list[k];
    const Vector3d ahead = particles.velocity.col(link.particle) +
                           tau * inverse_mass.col(k).cwiseProduct(Vector3d(particles.force.col(link.particle)));
    const Vector3d apart = links.displacement_gap(link, particles, displacement);
    for (int a = 0; a < link.n; ++a)
    {
      auto column = sums.col(link.node[a]);
      column.head<3>() += c[k] * link.N[a] * ahead;
      column.segment<3>(3) += c[k] * link.N[a] * apart;
    }
  }
  sums.bottomRows<3>() = reaction;
  int n_ranks = 1;
  MPI_Comm_size(settings.comm, &n_ranks);
  if (n_ranks > 1)
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, settings.comm);

  const Eigen::Matrix3Xd total_reaction = sums.bottomRows<3>();
  const Eigen::Matrix3Xd ahead = velocity + tau * inverse_node_mass.cwiseProduct(force + total_reaction);
  const Eigen::Matrix3Xd gap = sums.middleRows<3>(3);
  Eigen::Matrix3Xd lambda = Eigen::Matrix3Xd::Zero(3, n);
  node_force = rank == 0 ? total_reaction : Eigen::Matrix3Xd::Zero(3, n);
  for (int axis = 0; axis < packing.dim; ++axis)
  {
    const MultiplierEquations &system = *equations[equations_of_axis[axis]];
    const Eigen::VectorXd rate = sums.row(axis).transpose() - system.B() * ahead.row(axis).transpose() +
                                 drift_share / settings.time_step * gap.row(axis).transpose();
    const Eigen::VectorXd solution = system.solve(rate / tau);
    lambda.row(axis) = solution;
    if (rank == 0)
      node_force.row(axis) += (system.B() * solution).transpose();
  }
  for (std::size_t k = 0; k < list.size(); ++k)
  {
    const OverlapLink &link = list[k];
    Vector3d pull = Vector3d::Zero();
    for (int a = 0; a < link.n; ++a)
      pull += c[k] * link.N[a] * lambda.col(link.node[a]);
    particles.force.col(link.particle) -= pull;
    link_force[k] -= pull;
  }
}

/// The forces act at the point of the finite elements that the particle is tied to.
void MultiplierConstraint::add_couples(dem::Particles &particles)
{
  for (std::size_t k = 0; k < links.links().size(); ++k)
  {
    const OverlapLink &link = links.links()[k];
    const Vector3d couple = -links.displacement_gap(link, particles, displacement).cross(link_force[k]);
    particles.torque.col(link.particle) += couple;
    work.add(particles, link.particle, link_force[k], couple);
  }
}
} // namespace kerf
