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

template <int dim>
void MultiplierConstraint::pack(std::vector<Point<dim>> &points, const dem::Particles &particles) const
{
  points.clear();
  for (const OverlapLink &link : links.links())
  {
    const int i = link.particle, index = particles.index[i];
    Point<dim> point;
    point.particle = i;
    std::copy_n(link.origin.begin(), dim, point.origin.begin());
    for (int a = 0; a < 1 << dim; ++a)
    {
      point.node[a] = link.node[a < link.n ? a : 0];
      point.N[a] = a < link.n ? link.N[a] : 0.;
    }
    point.c = link.share * packing.volume(index);
    point.spring = holding_spring(settings, particles.weight[i], link.share, particles.mass[i]);
    point.viscosity =
      settings.relaxation / settings.time_step * fluctuation_share(particles.weight[i], link.share) * particles.mass[i];
    const auto held = blocked.find(index);
    for (int axis = 0; axis < dim; ++axis)
      point.inverse_mass[axis] = held != blocked.end() && held->second[axis] ? 0. : 1. / particles.mass[i];
    points.push_back(point);
  }
}

/// After particles changed place: the equations change with the links only.
void MultiplierConstraint::follow_particles(LinkChange change, const dem::Particles &particles, const fem::FemSide &fem)
{
  if (packing.dim == 2)
    pack(points_2d, particles);
  else
    pack(points_3d, particles);
  if (change == LinkChange::renewed)
    build_equations(fem);
}

/// Every rank builds the equations of all links and solves them: they are as many as the nodes of the overlap, and what each
/// rank adds to their right-hand side is a sum.
void MultiplierConstraint::build_equations(const fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  constexpr int record = 5 + 2 * 8; // c, three inverse masses, number of nodes, nodes, shape functions
  std::vector<double> mine;
  const auto list_points = [&](const auto &points)
  {
    mine.reserve(points.size() * record);
    for (std::size_t k = 0; k < points.size(); ++k)
    {
      const OverlapLink &link = links.links()[k];
      std::array<double, 3> inverse_mass{};
      std::copy(points[k].inverse_mass.begin(), points[k].inverse_mass.end(), inverse_mass.begin());
      mine.insert(mine.end(), {points[k].c, inverse_mass[0], inverse_mass[1], inverse_mass[2], double(link.n)});
      mine.insert(mine.end(), link.node.begin(), link.node.end());
      mine.insert(mine.end(), link.N.begin(), link.N.end());
    }
  };
  if (packing.dim == 2)
    list_points(points_2d);
  else
    list_points(points_3d);
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
  if (const LinkChange change = links.update(particles, fem); change != LinkChange::none)
    follow_particles(change, particles, fem);
  // In a step the hook sees v^{n-1/2} and the forces lead to v^{n+1/2}; after a setup half a step leads there.
  const double tau = phase == dem::Phase::step ? settings.time_step : 0.5 * settings.time_step;
  if (packing.dim == 2)
    impose(points_2d, tau, particles, fem);
  else
    impose(points_3d, tau, particles, fem);
}

/// Finds the forces after which the mean velocities agree at the next half step, and adds them.
template <int dim>
void MultiplierConstraint::impose(const std::vector<Point<dim>> &points, double tau, dem::Particles &particles,
                                  fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::displacement, displacement);
  fem.read_window(fem::NodalField::velocity, velocity);
  fem.read_window(fem::NodalField::force, force);
  gather_gaps(points, tau, particles);
  solve(tau, dim);
  scatter_forces(points, particles);
  fem.add_window_forces(node_force + spring_reaction);
  work.end(node_force, velocity);
}

/// Holds light particles by springs along chi, relaxes fluctuations by f_i = -viscosity (v_i - sum_a N_a v_a), and adds up at
/// the nodes, in this order of the rows: c N (velocity after the step, with what chi asks for to close), reaction of the
/// relaxation, reaction of the springs.
template <int dim>
void MultiplierConstraint::gather_gaps(const std::vector<Point<dim>> &points, double tau, dem::Particles &particles)
{
  const bool periodic = !packing.periodic.isZero(0.);
  const double closing = drift_share / settings.time_step;
  const double *x = particles.position.data(), *v = particles.velocity.data();
  const double *u_node = displacement.data(), *v_node = velocity.data();
  double *f = particles.force.data();
  sums.setZero(3 * dim, links.n_window());
  apart.setZero(3, points.size());
  link_force.setZero(3, points.size());
  double energy = 0.;
  for (std::size_t k = 0; k < points.size(); ++k)
  {
    const Point<dim> &point = points[k];
    const int i = 3 * point.particle;
    std::array<double, dim> chi, rate;
    for (int c = 0; c < dim; ++c)
    {
      chi[c] = x[i + c] - point.origin[c];
      rate[c] = v[i + c];
      for (int a = 0; a < 1 << dim; ++a)
      {
        chi[c] -= point.N[a] * u_node[3 * point.node[a] + c];
        rate[c] -= point.N[a] * v_node[3 * point.node[a] + c];
      }
    }
    if (periodic)
      for (int c = 0; c < dim; ++c)
        if (packing.periodic[c] > 0.)
          chi[c] -= packing.periodic[c] * std::round(chi[c] / packing.periodic[c]);
    std::array<double, 3 * dim> terms;
    for (int c = 0; c < dim; ++c)
    {
      const double held = point.spring * chi[c], relaxed = point.viscosity * rate[c];
      f[i + c] -= held + relaxed;
      terms[c] = point.c * (v[i + c] + tau * point.inverse_mass[c] * f[i + c] + closing * chi[c]);
      terms[dim + c] = relaxed;
      terms[2 * dim + c] = held;
      energy += 0.5 * held * chi[c];
      apart(c, k) = chi[c];
      link_force(c, k) = -relaxed;
    }
    for (int a = 0; a < 1 << dim; ++a)
    {
      double *sum = sums.data() + 3 * dim * point.node[a];
      for (int t = 0; t < 3 * dim; ++t)
        sum[t] += point.N[a] * terms[t];
    }
  }
  stored = energy;
  int n_ranks = 1;
  MPI_Comm_size(settings.comm, &n_ranks);
  if (n_ranks > 1)
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, settings.comm);
}

/// The multipliers, and the forces at the nodes; the first rank adds them.
void MultiplierConstraint::solve(double tau, int dim)
{
  const int n = links.n_window();
  lambda.setZero(3, n);
  node_force.setZero(3, n);
  spring_reaction.setZero(3, n);
  for (int axis = 0; axis < dim; ++axis)
  {
    const MultiplierEquations &system = *equations[equations_of_axis[axis]];
    const auto reaction = sums.row(dim + axis) + sums.row(2 * dim + axis);
    const Eigen::VectorXd ahead =
      velocity.row(axis) + tau * inverse_node_mass.row(axis).cwiseProduct(force.row(axis) + reaction);
    const Eigen::VectorXd solution = system.solve((sums.row(axis).transpose() - system.B() * ahead) / tau);
    lambda.row(axis) = solution;
    if (rank == 0)
    {
      node_force.row(axis) = sums.row(dim + axis) + (system.B() * solution).transpose();
      spring_reaction.row(axis) = sums.row(2 * dim + axis);
    }
  }
}

/// The multipliers' forces on the particles. Forces act at the point of the finite elements that the particle is tied to; those
/// that are not along chi come with a couple.
template <int dim>
void MultiplierConstraint::scatter_forces(const std::vector<Point<dim>> &points, dem::Particles &particles)
{
  for (std::size_t k = 0; k < points.size(); ++k)
  {
    const Point<dim> &point = points[k];
    auto total = link_force.col(k);
    for (int c = 0; c < dim; ++c)
    {
      double pull = 0.;
      for (int a = 0; a < 1 << dim; ++a)
        pull += point.N[a] * lambda(c, point.node[a]);
      particles.force(c, point.particle) -= point.c * pull;
      total[c] -= point.c * pull;
    }
    const Vector3d couple = -Vector3d(apart.col(k)).cross(Vector3d(total));
    particles.torque.col(point.particle) += couple;
    work.add(particles, point.particle, total, couple);
  }
}
} // namespace kerf
