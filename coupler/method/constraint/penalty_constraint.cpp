// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/penalty_constraint.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
double penalty_stiffness(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  if (mu <= 0.)
    return 0.;
  return share * (settings.mass_scaled ? settings.beta * mu / (settings.time_step * settings.time_step) : settings.stiffness);
}

double penalty_viscosity(const PenaltyConstraint::Settings &settings, double share, double mu)
{
  return 2. * settings.damping * std::sqrt(penalty_stiffness(settings, share, mu) * share * mu);
}

namespace
{
std::unique_ptr<Constraint> make(const ConstraintModel &model, bool mass_scaled)
{
  PenaltyConstraint::Settings settings;
  settings.comm = model.comm;
  settings.mass_scaled = mass_scaled;
  settings.beta = model.settings.penalty_ratio;
  settings.stiffness = model.settings.penalty_ratio * model.k_n;
  settings.damping = model.settings.interface_damping;
  settings.corrector = model.settings.corrector;
  settings.k_n = model.k_n;
  settings.k_t = model.k_t;
  return std::make_unique<PenaltyConstraint>(settings, *model.packing);
}
} // namespace

std::unique_ptr<Constraint> make_penalty(const ConstraintModel &model)
{
  return make(model, false);
}

std::unique_ptr<Constraint> make_mass_scaled_penalty(const ConstraintModel &model)
{
  return make(model, true);
}

PenaltyConstraint::PenaltyConstraint(const Settings &settings, const dem::Packing &packing)
  : settings(settings), packing(packing), interpolation(packing, WindowNodes::own, settings.comm),
    damping_work(settings.time_step, settings.comm)
{
  if (settings.corrector)
    interpolation.widen([this](int node) { return corrector->gradient().nodes_around(node); });
}

void PenaltyConstraint::set_time_step(double dt)
{
  settings.time_step = dt;
  damping_work = InterfaceWork(dt, settings.comm);
}

Refusal PenaltyConstraint::refusal(double) const
{
  return settings.mass_scaled && settings.beta >= 2. ? Refusal::ratio_too_large : Refusal::none;
}

double PenaltyConstraint::bound_of_added_omega2(double dt, double lightest) const
{
  const double damping = settings.damping;
  if (settings.mass_scaled)
    return settings.beta + 4. * damping * std::sqrt(settings.beta);
  const double k = settings.stiffness;
  return dt * dt * k / lightest + 4. * damping * dt * std::sqrt(k / lightest);
}

double PenaltyConstraint::operator_coefficient(const OperatorTie &tie, double dt) const
{
  Settings at_step = settings;
  at_step.time_step = dt;
  return dt * dt * penalty_stiffness(at_step, tie.share, tie.mu) + 2. * dt * penalty_viscosity(at_step, tie.share, tie.mu);
}

std::vector<TieRow> PenaltyConstraint::rows(const fem::FemSide &fem, const std::vector<TiedParticle> &tied_particles)
{
  if (!settings.corrector)
    return {};
  make_corrector(fem);
  const Eigen::VectorXd node_mass = fem.gather(fem::NodalField::mass).row(0);
  std::vector<int> indices;
  for (const TiedParticle &particle : tied_particles)
    indices.push_back(particle.index);
  corrector->set_masses(node_mass);
  std::vector<Corrector::Row> places = corrector->rows(indices);
  const std::vector<double> masses = inverse_masses_of_nodes(corrector->lengths(indices), tied_particles, node_mass);
  std::vector<TieRow> result(places.size());
  for (std::size_t k = 0; k < places.size(); ++k)
    result[k] = {std::move(places[k].node), std::move(places[k].P), masses[k]};
  return result;
}

void PenaltyConstraint::set_particles(const std::vector<TiedParticle> &particles)
{
  interpolation.set_particles(particles);
  if (settings.corrector)
    tied = particles;
  of_nodes.clear();
}

void PenaltyConstraint::make_corrector(const fem::FemSide &fem)
{
  if (!settings.corrector || corrector)
    return;
  corrector =
    std::make_unique<Corrector>(packing, std::make_shared<Fluctuations>(packing, settings.k_n, settings.k_t, fem), fem);
}

void PenaltyConstraint::place(std::vector<dem::NewParticle> &particles, const fem::FemSide &fem)
{
  if (!settings.corrector)
    return;
  const Eigen::Matrix3Xd u = fem.gather(fem::NodalField::displacement), v = fem.gather(fem::NodalField::velocity);
  if (u.isZero(0.) && v.isZero(0.))
    return; // the undeformed body needs no correction
  make_corrector(fem);
  corrector->set_masses(fem.gather(fem::NodalField::mass).row(0));
  corrector->place(particles, u, v);
}

/// Like ParticleInterpolation::tied_masses(), for the rows of the corrector.
std::vector<double> PenaltyConstraint::masses_of_rows(const dem::Particles &particles, const fem::FemSide &fem)
{
  if (of_nodes.empty())
  {
    std::vector<int> indices;
    for (const TiedParticle &particle : tied)
      indices.push_back(particle.index);
    const Eigen::VectorXd node_mass = fem.gather(fem::NodalField::mass).row(0);
    corrector->set_masses(node_mass);
    of_nodes = inverse_masses_of_nodes(corrector->lengths(indices), tied, node_mass);
  }
  std::vector<double> masses;
  for (const InterpolatedParticle &entry : interpolation.entries())
    masses.push_back(of_nodes[entry.row] < 0. ? 0. : 1. / (1. / particles.mass[entry.particle] + of_nodes[entry.row]));
  return masses;
}

void PenaltyConstraint::choose_springs(const dem::Particles &particles, fem::FemSide &fem)
{
  const std::vector<double> masses =
    settings.corrector ? masses_of_rows(particles, fem) : interpolation.tied_masses(particles, fem);
  stiffness.clear();
  viscosity.clear();
  for (std::size_t k = 0; k < masses.size(); ++k)
  {
    const double share = interpolation.entries()[k].share;
    stiffness.push_back(penalty_stiffness(settings, share, masses[k]));
    viscosity.push_back(penalty_viscosity(settings, share, masses[k]));
  }
}

template <int dim>
void PenaltyConstraint::renew(Springs<dim> &springs, const dem::Particles &particles, fem::FemSide &fem)
{
  choose_springs(particles, fem);
  springs.cells.assign(interpolation, fem.mesh(), packing);
  springs.stiffness = springs.cells.lanes_of([this](std::size_t k) { return stiffness[k]; });
  if (settings.corrector)
    springs.corrected.renew(springs.cells, interpolation, *corrector, particles, stiffness);
}

template <int dim>
void PenaltyConstraint::apply(Springs<dim> &springs, dem::Particles &particles, fem::FemSide &fem)
{
  make_corrector(fem);
  const InterpolationChange change = interpolation.update(particles, fem);
  if (change == InterpolationChange::renewed)
    renew(springs, particles, fem);
  else if (change == InterpolationChange::renumbered)
  {
    springs.cells.renumber(interpolation);
    springs.corrected.renumber(interpolation);
  }

  fem.read_window(fem::NodalField::displacement, node_displacement);
  node_force.setZero(3, interpolation.n_window());
  if (settings.corrector)
    stored = springs.corrected.pull(springs.cells, node_displacement, packing.periodic, particles, node_force);
  else if (packing.periodic.isZero(0.))
    pull<dim, false>(springs, particles);
  else
    pull<dim, true>(springs, particles);
  fem.add_window_forces(node_force);
}

/// f_i = -k_i chi_i and its reaction. Theory (5.3), (5.5).
template <int dim, bool periodic>
void PenaltyConstraint::pull(Springs<dim> &springs, dem::Particles &particles)
{
  using Vectors = PackedVectors<dim>;
  constexpr int corners = CellBatches<dim>::corners;
  SimdPack energy = {};
  int k = 0;
  for (const auto &cell : springs.cells.cells())
  {
    SimdPack place[corners], given[corners] = {};
    springs.cells.places(cell, node_displacement, place);
    for (; k < cell.end; ++k)
    {
      springs.cells.fetch_after(k, particles.position, particles.force);
      const auto &batch = springs.cells.batches()[k];
#pragma GCC unroll 2
      for (int p = 0; p < n_packs<dim>; ++p)
      {
        const auto *at = batch.begins(p);
        const auto xi = batch.place(p);
        const SimdPack position = Vectors::load(particles.position.data(), at),
                       gap = CellBatches<dim>::template minus_chi<periodic>(place, xi, position, packing.periodic);
        const SimdPack force = Vectors::spread(springs.stiffness[k], p) * gap;
        energy += 0.5 * force * gap;
        Vectors::store(particles.force.data(), at, Vectors::load(particles.force.data(), at) + force);
        add_moments(force, xi, given);
      }
    }
    springs.cells.scatter(cell, given, -1., node_force);
  }
  stored = sum_of(energy);
}

Eigen::VectorXd PenaltyConstraint::springs() const
{
  Eigen::VectorXd result = Eigen::VectorXd::Zero(n_local);
  for (std::size_t k = 0; k < interpolation.entries().size(); ++k)
    result[interpolation.entries()[k].particle] = stiffness[k];
  return result;
}

void PenaltyConstraint::apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem)
{
  stored = 0.;
  if (interpolation.n_particles() == 0)
    return;
  if (settings.damping > 0.)
  {
    if (phase == dem::Phase::step)
      fem.read_window(fem::NodalField::velocity, node_velocity); // before update() changes the nodal window
    damping_work.begin(phase, particles, node_velocity);
  }
  n_local = particles.n;
  if (packing.dim == 2)
    apply(springs_2d, particles, fem);
  else
    apply(springs_3d, particles, fem);
  if (settings.damping > 0.)
    add_damping(particles, fem);
}

/// Damping uses the velocities of the last half step. Theory (5.7).
void PenaltyConstraint::add_damping(dem::Particles &particles, fem::FemSide &fem)
{
  fem.read_window(fem::NodalField::velocity, node_velocity);
  node_force.setZero();
  for (std::size_t k = 0; k < interpolation.entries().size(); ++k)
  {
    const InterpolatedParticle &entry = interpolation.entries()[k];
    const Eigen::Vector3d force = viscosity[k] * ParticleInterpolation::mismatch(entry, particles.velocity, node_velocity);
    const Eigen::Vector3d couple = interpolation.chi(entry, particles, node_displacement).cross(force);
    particles.force.col(entry.particle) -= force;
    particles.torque.col(entry.particle) += couple;
    damping_work.add(particles, entry.particle, -force, couple);
    ParticleInterpolation::spread(entry, force, node_force);
  }
  fem.add_window_forces(node_force);
  damping_work.end(node_force, node_velocity);
}
} // namespace kerf
