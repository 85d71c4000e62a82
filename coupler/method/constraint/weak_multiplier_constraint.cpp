// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/weak_multiplier_constraint.h"

#include "coupler/base/mpi_helpers.h"
#include "coupler/method/constraint/exchange/begin_exchange.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace kerf
{
namespace
{
/// Fraction of the gap between the mean displacements that is removed in a step. The constraint on velocities is exact, so a
/// gap arises only from the projection of new particles and from forces that are unknown to the constraint, like local damping.
/// Theory (5.14).
constexpr double drift_share = 0.02;

/// Smallest cell edge in particle diameters. Smaller cells hold too few particles for means around nodes.
constexpr double finest_cells = 1.5;

/// Projection onto the motions that satisfy the weak constraint, for the coupled operator. Theory (8.3).
class MultiplierProjection : public MotionProjection
{
public:
  MultiplierProjection(int dim, const std::vector<OperatorTie> &ties, const Eigen::VectorXd &inverse_root_mass);
  void project(Eigen::VectorXd &y) const override;

private:
  int dim;
  const std::vector<OperatorTie> &ties;
  const Eigen::VectorXd &inverse_root_mass;
  std::unique_ptr<MultiplierSystem> equations;
  std::vector<int> multiplier_nodes; // by their first degrees of freedom
  std::vector<int> tie_multipliers;  // 8 for each tied particle: positions in multiplier_nodes
};

MultiplierProjection::MultiplierProjection(int dim, const std::vector<OperatorTie> &ties,
                                           const Eigen::VectorXd &inverse_root_mass)
  : dim(dim), ties(ties), inverse_root_mass(inverse_root_mass)
{
  std::unordered_map<int, int> place;
  for (const OperatorTie &tie : ties)
    for (int a = 0; a < 8; ++a)
    {
      if (a >= tie.n)
      {
        tie_multipliers.push_back(-1);
        continue;
      }
      const auto entry = place.emplace(tie.node[a], static_cast<int>(multiplier_nodes.size()));
      if (entry.second)
        multiplier_nodes.push_back(tie.node[a]);
      tie_multipliers.push_back(entry.first->second);
    }
  std::vector<MultiplierSystem::Row> rows(ties.size());
  Eigen::Matrix3Xd inverse_mass = Eigen::Matrix3Xd::Zero(3, multiplier_nodes.size());
  for (std::size_t k = 0; k < ties.size(); ++k)
  {
    rows[k] = {ties[k].measure, {}, ties[k].n, &tie_multipliers[8 * k], ties[k].N.data()};
    for (int axis = 0; axis < dim; ++axis)
      rows[k].inverse_mass[axis] = std::pow(inverse_root_mass[ties[k].particle + axis], 2);
  }
  for (std::size_t m = 0; m < multiplier_nodes.size(); ++m)
    for (int axis = 0; axis < dim; ++axis)
      inverse_mass(axis, m) = std::pow(inverse_root_mass[multiplier_nodes[m] + axis], 2);
  equations = std::make_unique<MultiplierSystem>(dim, rows, inverse_mass);
}

void MultiplierProjection::project(Eigen::VectorXd &y) const
{
  using Few = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, 3, 1>;
  const auto roots = [&](int dof) { return inverse_root_mass.segment(dof, dim); };
  const auto motion = [&](int dof) { return roots(dof).cwiseProduct(y.segment(dof, dim)); };
  Eigen::MatrixXd at_nodes(dim, multiplier_nodes.size()), gap;
  for (std::size_t m = 0; m < multiplier_nodes.size(); ++m)
    at_nodes.col(m) = motion(multiplier_nodes[m]);
  equations->multiply(-at_nodes, gap);
  for (std::size_t k = 0; k < ties.size(); ++k)
  {
    const Few moved = ties[k].measure * motion(ties[k].particle);
    for (int a = 0; a < ties[k].n; ++a)
      gap.col(tie_multipliers[8 * k + a]) += ties[k].N[a] * moved;
  }
  equations->solve(gap);
  const Eigen::MatrixXd &lambda = gap;
  for (std::size_t k = 0; k < ties.size(); ++k)
  {
    Few force = Few::Zero(dim);
    for (int a = 0; a < ties[k].n; ++a)
      force += ties[k].measure * ties[k].N[a] * lambda.col(tie_multipliers[8 * k + a]);
    y.segment(ties[k].particle, dim) -= roots(ties[k].particle).cwiseProduct(force);
  }
  Eigen::MatrixXd &pull = at_nodes;
  equations->multiply(lambda, pull);
  for (std::size_t m = 0; m < multiplier_nodes.size(); ++m)
    y.segment(multiplier_nodes[m], dim) += roots(multiplier_nodes[m]).cwiseProduct(pull.col(m));
}

} // namespace

/// A particle of the outermost row has the weight d/(2 L_o). The springs have this fraction of k_n. Under the load of the
/// particle they yield by about its diameter times the strain. They are about one per cent of the stiffness of a particle with
/// weight one half. Theory (5.17).
std::unique_ptr<Constraint> make_weak_multipliers(const ConstraintModel &model)
{
  WeakMultiplierConstraint::Settings settings;
  settings.comm = model.comm;
  settings.relaxation = model.settings.fluctuation_relaxation;
  settings.holding = 0.5 * model.k_n * model.mean_diameter / model.overlap.width;
  return std::make_unique<WeakMultiplierConstraint>(settings, *model.packing);
}

double fluctuation_share(double weight, double share)
{
  return std::max(share, 1. - weight);
}

double holding_spring(const WeakMultiplierConstraint::Settings &settings, double weight, double share, double mass)
{
  constexpr double share_of_step = 0.5; // largest contribution to omega^2 dt^2
  const double dt = settings.time_step;
  return fluctuation_share(weight, share) *
         std::min(settings.holding * (1. - weight) * (1. - weight), share_of_step * mass / (dt * dt));
}

WeakMultiplierConstraint::WeakMultiplierConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), interpolation(packing, WindowNodes::all, settings.comm),
    work(settings.time_step, settings.comm)
{
  rank = rank_of(settings.comm);
}

void WeakMultiplierConstraint::set_time_step(double dt)
{
  settings.time_step = dt;
  work = InterfaceWork(dt, settings.comm);
}

Refusal WeakMultiplierConstraint::refusal(double smallest_edge) const
{
  return smallest_edge < finest_cells ? Refusal::cells_too_fine : Refusal::none;
}

double WeakMultiplierConstraint::bound_of_added_omega2(double, double) const
{
  return 2. * settings.relaxation; // for fluctuations, which do not move nodes
}

double WeakMultiplierConstraint::operator_coefficient(const OperatorTie &tie, double dt) const
{
  Settings at_step = settings;
  at_step.time_step = dt;
  return 2. * settings.relaxation * fluctuation_share(tie.weight, tie.share) * tie.mass +
         dt * dt * holding_spring(at_step, tie.weight, tie.share, tie.mass);
}

std::unique_ptr<MotionProjection> WeakMultiplierConstraint::projection(const std::vector<OperatorTie> &ties,
                                                                       const Eigen::VectorXd &inverse_root_mass) const
{
  if (ties.empty())
    return nullptr;
  return std::make_unique<MultiplierProjection>(packing.dim, ties, inverse_root_mass);
}

void WeakMultiplierConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  interpolation.set_particles(particles);
}

template <int dim>
void WeakMultiplierConstraint::renew(Ties<dim> &ties, const dem::Particles &particles, const fem::FemSide &fem)
{
  const std::vector<InterpolatedParticle> &list = interpolation.entries();
  ties.cells.assign(interpolation, fem.mesh(), packing);
  const auto share_of_fluctuation = [&](std::size_t k)
  { return fluctuation_share(particles.weight[list[k].particle], list[k].share); };
  ties.c =
    ties.cells.lanes_of([&](std::size_t k) { return list[k].share * packing.volume(particles.index[list[k].particle]); });
  ties.spring = ties.cells.lanes_of(
    [&](std::size_t k)
    {
      const int i = list[k].particle;
      return holding_spring(settings, particles.weight[i], list[k].share, particles.mass[i]);
    });
  ties.viscosity = ties.cells.lanes_of(
    [&](std::size_t k)
    { return settings.relaxation / settings.time_step * share_of_fluctuation(k) * particles.mass[list[k].particle]; });
  ties.inverse_mass.assign(ties.cells, interpolation, particles);
  for (auto *values : {&ties.gap, &ties.velocity, &ties.relaxed})
    values->resize(n_packs<dim> * ties.cells.batches().size());
  ties.loads.renew(ties.cells, particles);
  build_equations(ties, particles, fem);
  couples.renew(fem.mesh(), interpolation.window(), inverse_node_mass);
}

/// Every rank builds and solves the equations of all ranks. Their number is that of the overlap nodes. The right-hand side is
/// summed over the ranks.
template <int dim>
void WeakMultiplierConstraint::build_equations(const Ties<dim> &ties, const dem::Particles &particles, const fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::inverse_mass, inverse_node_mass);
  constexpr int record = 5 + 2 * 8; // c, three inverse masses, number of nodes, nodes, shape functions
  std::vector<double> of_rank;
  of_rank.reserve(interpolation.entries().size() * record);
  for (std::size_t k = 0; k < ties.c.size(); ++k)
    for (int l = 0; l < n_simd_lanes; ++l)
      if (ties.cells.is_used(k, l))
      {
        const InterpolatedParticle &entry = interpolation.entries()[ties.cells.entry(k, l)];
        std::array<double, 3> inverse_mass{};
        for (int axis = 0; axis < dim; ++axis)
          inverse_mass[axis] = entry.blocked[axis] ? 0. : 1. / particles.mass[entry.particle];
        of_rank.insert(of_rank.end(), {ties.c[k][l], inverse_mass[0], inverse_mass[1], inverse_mass[2], double(entry.n)});
        of_rank.insert(of_rank.end(), entry.node.begin(), entry.node.end());
        of_rank.insert(of_rank.end(), entry.N.begin(), entry.N.end());
      }
  const std::vector<double> all = gather_all(of_rank, MPI_DOUBLE, settings.comm);
  const std::size_t n = all.size() / record;
  std::vector<int> nodes(8 * n);
  std::vector<MultiplierSystem::Row> rows(n);
  for (std::size_t k = 0; k < n; ++k)
  {
    const double *values = &all[k * record];
    rows[k].c = values[0];
    std::copy(values + 1, values + 4, rows[k].inverse_mass.begin());
    rows[k].n = static_cast<int>(values[4]);
    std::copy(values + 5, values + 13, &nodes[8 * k]);
    rows[k].node = &nodes[8 * k];
    rows[k].N = values + 13;
  }
  equations = std::make_unique<MultiplierSystem>(dim, rows, inverse_node_mass);
}

void WeakMultiplierConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (interpolation.n_particles() == 0)
    return;
  if (packing.dim == 2)
    apply(ties_2d, phase, particles, fem);
  else
    apply(ties_3d, phase, particles, fem);
}

/// Computes and adds the forces that make the mean velocities equal at the next half step.
template <int dim>
void WeakMultiplierConstraint::apply(Ties<dim> &ties, dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  const double dt = settings.time_step,
               tau = begin_exchange<dim>(phase, particles, fem, packing, dt, interpolation, ties.cells, ties.loads, work,
                                         {displacement, velocity, force}, settings.comm, [&] { renew(ties, particles, fem); });
  packing.periodic.isZero(0.) ? gather_gaps<dim, false>(ties, tau, particles) : gather_gaps<dim, true>(ties, tau, particles);
  solve<dim>(tau);
  const double power = scatter_forces(ties, particles);
  reaction = node_force;
  if (rank == 0)
    reaction += sums.middleRows<3>(6);
  if (phase == dem::Phase::step)
    work.add_energy(0.5 * dt * power);
  fem.add_window_forces(reaction);
  work.end(node_force, velocity);
}

/// Adds spring forces along chi to light particles and relaxation forces f_i = -viscosity (v_i - sum_a N_a v_a). Assembles
/// three vectors at each node: the momentum sum c N (velocity after the step, corrected for the gap chi), the reaction of the
/// relaxation, and the reaction of the springs. Theory (5.11), (5.15), (5.17).
template <int dim, bool periodic>
void WeakMultiplierConstraint::gather_gaps(Ties<dim> &ties, double tau, dem::Particles &particles)
{
  using Vectors = PackedVectors<dim>;
  constexpr int corners = CellBatches<dim>::corners;
  const double closing = drift_share / settings.time_step;
  sums.setZero(9, interpolation.n_window());
  SimdPack energy = {};
  int k = 0;
  for (const auto &cell : ties.cells.cells())
  {
    SimdPack place[corners], v[corners], momentum[corners] = {}, damping[corners] = {}, holding[corners] = {};
    ties.cells.places(cell, displacement, place);
    ties.cells.coefficients(cell, velocity, v);
    for (; k < cell.end; ++k)
    {
      ties.cells.fetch_after(k, particles.position, particles.velocity, particles.force);
      const auto &batch = ties.cells.batches()[k];
#pragma GCC unroll 2
      for (int p = 0; p < n_packs<dim>; ++p)
      {
        const auto *at = batch.begins(p);
        const int pack = n_packs<dim> * k + p;
        const auto xi = batch.place(p);
        const SimdPack position = Vectors::load(particles.position.data(), at),
                       own_velocity = Vectors::load(particles.velocity.data(), at),
                       own_force = Vectors::load(particles.force.data(), at);
        const SimdPack gap = CellBatches<dim>::template minus_chi<periodic>(place, xi, position, packing.periodic);
        const SimdPack held = Vectors::spread(ties.spring[k], p) * gap,
                       relaxed = Vectors::spread(ties.viscosity[k], p) * (value_of(v, xi) - own_velocity),
                       total = own_force + held + relaxed;
        Vectors::store(particles.force.data(), at, total);
        const SimdPack ahead = own_velocity + tau * ties.inverse_mass.of(k, p, cell) * total;
        energy += 0.5 * held * gap;
        add_moments(SimdPack(Vectors::spread(ties.c[k], p) * (ahead - closing * gap)), xi, momentum);
        add_moments(relaxed, xi, damping);
        add_moments(held, xi, holding);
        ties.gap[pack] = gap;
        ties.velocity[pack] = own_velocity;
        ties.relaxed[pack] = relaxed;
      }
    }
    ties.cells.scatter(cell, momentum, 1., sums.middleRows<3>(0));
    ties.cells.scatter(cell, damping, -1., sums.middleRows<3>(3));
    ties.cells.scatter(cell, holding, -1., sums.middleRows<3>(6));
  }
  stored = sum_of(energy);
  int n_ranks = 1;
  MPI_Comm_size(settings.comm, &n_ranks);
  if (n_ranks > 1)
    MPI_Allreduce(MPI_IN_PLACE, sums.data(), static_cast<int>(sums.size()), MPI_DOUBLE, MPI_SUM, settings.comm);
}

/// Solves for the multipliers. The nodal forces are computed on the first rank only, so that they are added once. Theory
/// (5.12).
template <int dim>
void WeakMultiplierConstraint::solve(double tau)
{
  const int n = interpolation.n_window();
  ahead = velocity.topRows<dim>() + tau * inverse_node_mass.topRows<dim>().cwiseProduct(
                                            force.topRows<dim>() + sums.middleRows<dim>(3) + sums.middleRows<dim>(6));
  equations->multiply(ahead, lambda);
  lambda = (sums.topRows<dim>() - lambda) / tau;
  equations->solve(lambda);
  node_force.setZero(3, n);
  if (rank != 0)
    return;
  equations->multiply(lambda, ahead);
  node_force.topRows<dim>() = sums.middleRows<dim>(3) + ahead;
}

/// Adds the multiplier forces to the particles. Returns the power of the forces of the previous step and of the new ones [W].
template <int dim>
double WeakMultiplierConstraint::scatter_forces(Ties<dim> &ties, dem::Particles &particles)
{
  using Vectors = PackedVectors<dim>;
  constexpr int corners = CellBatches<dim>::corners;
  SimdPack power = {};
  typename Vectors::Couple couple;
  int k = 0;
  for (const auto &cell : ties.cells.cells())
  {
    SimdPack multiplier[corners];
    ties.cells.coefficients(cell, lambda, multiplier);
    for (; k < cell.end; ++k)
    {
      ties.cells.fetch_after(k, particles.force);
      const auto &batch = ties.cells.batches()[k];
#pragma GCC unroll 2
      for (int p = 0; p < n_packs<dim>; ++p)
      {
        const auto *at = batch.begins(p);
        const int pack = n_packs<dim> * k + p;
        const SimdPack force = -Vectors::spread(ties.c[k], p) * value_of(multiplier, batch.place(p)),
                       load = ties.relaxed[pack] + force;
        Vectors::store(particles.force.data(), at, Vectors::load(particles.force.data(), at) + force);
        power += ties.loads.exchange(pack, load) * ties.velocity[pack];
        couple.add(ties.gap[pack], load);
      }
    }
  }
  couples.add(couple.sum(), displacement, node_force);
  return sum_of(power);
}
} // namespace kerf
