// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/coupled_model.h"

#include "coupler/application/case_file/fem_settings.h"
#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/relaxation.h"
#include "coupler/method/stability/stable_step.h"

#include <algorithm>
#include <numeric>

namespace kerf
{
ConstraintModel constraint_model(const Case &settings, const dem::Packing &packing, MPI_Comm comm)
{
  return {settings.constraint,
          settings.overlap,
          settings.bond.k_n,
          settings.bond.k_t,
          settings.packing.mean_diameter,
          &packing,
          comm};
}

dem::Settings particle_settings(const Case &settings, const dem::Packing &packing, double dt, MPI_Comm comm)
{
  dem::Settings result;
  result.comm = comm;
  result.packing = &packing;
  result.bond = settings.bond;
  result.density = particle_density(settings, packing);
  result.local_damping = settings.local_damping;
  result.time_step = dt;
  // Fragments fly: the domain is larger than the rock by its height on every side.
  const Eigen::Vector3d extent = packing.upper - packing.lower;
  const double margin = std::max(extent[1], 0.5 * extent[0]);
  result.domain_lower = packing.lower.array() - margin;
  result.domain_upper = packing.upper.array() + margin;
  return result;
}

CoupledModel::CoupledModel(const Case &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, double dt,
                           MPI_Comm comm, std::unique_ptr<Constraint> given_constraint)
  : settings(settings), mode(mode), fem_side(fem), packing(packing), dt(dt), comm(comm),
    dem_side(std::make_unique<dem::DemSide>(particle_settings(settings, packing, dt, comm))),
    regions(fem.mesh(), fem.quadrature_points(), packing, settings.overlap.weight_function, settings.overlap.width),
    activation(settings, fem.mesh(), comm), virial_stress(fem.mesh(), packing, comm),
    return_rule(settings, fem.mesh(), packing, virial_stress, comm),
    boundary(fem.mesh(), settings.rock, settings.boundary_conditions, packing),
    loads(fem_settings(settings, MPI_COMM_SELF), fem.mesh(), packing),
    constraint(given_constraint ? std::move(given_constraint) : make_constraint(constraint_model(settings, packing, comm))),
    monitor(settings, packing, comm),
    cutter(settings.tool, packing.dim, settings.bond.k_n, packing.mean_diameter, settings.rock.density, comm),
    debris_contact(settings.bond, packing, dt, comm), tool_work(dt, comm), debris_work(dt, comm), boundary_work(dt, comm),
    absorbing_work(dt, comm)
{
  constraint->set_time_step(dt);
}

void CoupledModel::start()
{
  std::vector<int> cells;
  if (mode == Mode::dem)
  {
    cells.resize(fem_side.mesh().n_cells());
    std::iota(cells.begin(), cells.end(), 0);
  }
  else if (mode == Mode::fixed)
    cells = cells_inside(fem_side.mesh(), settings.fixed_region);
  fem_side.compute_forces();
  if (!cells.empty())
  {
    clock.begin_whole(Part::activation);
    convert(cells);
    clock.end_whole();
  }
  conversion_energy = 0.; // what the body starts with is not a change of models
  const EnergyLedger ledger = energies();
  initial_energy = ledger.held() + ledger.lost() - ledger.work();
}

void CoupledModel::cycle(dem::Phase phase, dem::Particles &particles)
{
  clock.lap(Part::dem);
  const bool with_fem = fem_side.n_active_cells() > 0 && !relaxing;
  const bool stepping = phase == dem::Phase::step;
  if (stepping)
  {
    ++n_steps;
    now = n_steps * dt;
  }
  for (ParticleWork *work : {&tool_work, &debris_work, &boundary_work, &absorbing_work})
    work->begin(phase, particles);

  if (with_fem)
  {
    if (stepping)
      fem_side.begin_step(dt, now); // the particles have drifted already
    fem_side.compute_forces();
  }
  clock.lap(Part::fem);

  if (cutter.present())
  {
    if (stepping)
      cutter.move_to(now);
    cutter.apply(tool_forces.catch_forces(particles), fem_side.n_active_cells() > 0 ? &fem_side : nullptr);
    tool_forces.release(cutter.touched(), particles, tool_work);
    if (stepping)
    {
      local_impulse.force += dt * cutter.local_load().force;
      impulse_duration += dt;
    }
  }
  if (with_fem)
    debris_contact.apply(phase, particles, fem_side, debris_work);
  clock.lap(Part::tool);
  boundary.damp(particles, absorbing_work);
  loads.apply(particles, now, boundary_work);
  clock.lap(Part::dem);

  if (!relaxing || constraint->tie() == Tie::spring)
    constraint->apply(phase, particles, fem_side); // sees all other forces
  clock.lap(Part::exchange);

  boundary.hold(particles, now, dt, boundary_work);
  clock.lap(Part::dem);
  if (with_fem && stepping)
    fem_side.end_step(dt, now);
  clock.lap(Part::fem); // the particles' second half kick follows when the hook returns
}

void CoupledModel::advance(int steps)
{
  clock.restart();
  try
  {
    dem_side->advance(steps, [this](dem::Phase phase, dem::Particles &particles) { cycle(phase, particles); });
  }
  catch (const std::runtime_error &error)
  {
    // The particle side notices runaway bonds before energies are looked at, on all ranks alike.
    throw UnstableRun("run became unstable near t = " + std::to_string(now) + " s: " + error.what());
  }
  if (fem_side.n_active_cells() > 0)
    debris_contact.find_debris(*dem_side, regions.bonds(), regions.tied_particles());
  clock.lap(Part::dem);
}

bool CoupledModel::adapt()
{
  if (mode != Mode::adaptive)
    return false;
  clock.begin_whole(Part::activation);
  const std::size_t n_events = activation_events.size();
  if (const std::vector<int> cells = activation.cells_to_convert(fem_side, regions); !cells.empty())
    convert(cells);
  else if (return_rule.due(now))
    return_to_continuum(return_rule.cells_to_return(fem_side, regions, *dem_side, now));
  clock.end_whole();
  return activation_events.size() > n_events;
}

/// A change of models: what the body holds before it.
ActivationEvent CoupledModel::open_event()
{
  ActivationEvent event;
  event.step = n_steps;
  event.time = now;
  const EnergyLedger ledger = energies();
  conversion_energy -= ledger.held();
  event.before = conserved_quantities(fem_side, *dem_side, ledger, comm);
  return event;
}

/// What it holds after it; the difference came in by the change.
void CoupledModel::close_event(ActivationEvent &event)
{
  const EnergyLedger ledger = energies();
  conversion_energy += ledger.held();
  event.after = conserved_quantities(fem_side, *dem_side, ledger, comm);
  activation_events.push_back(event);
}

void CoupledModel::convert(const std::vector<int> &cells)
{
  ActivationEvent event = open_event();
  event.cells = static_cast<int>(cells.size());
  const CellStresses stress = stresses_of(cells, false);

  std::vector<std::pair<int, double>> weights; // of ties that hold means, around which particles relax_particles
  if (constraint->tie() == Tie::mean)
    for (const TiedParticle &particle : active_ties())
      weights.emplace_back(particle.index, regions.de_weights()[particle.index]);
  regions.convert(cells);
  std::vector<int> reweighted;
  for (const auto &[index, weight] : weights)
    if (regions.de_weights()[index] != weight)
      reweighted.push_back(index);
  // Project while the finite elements still carry the field everywhere.
  std::vector<dem::NewParticle> particles = project(fem_side, regions, packing, dem_side->is_taken(), comm);
  constraint->place(particles, fem_side);
  event.particles = static_cast<int>(particles.size());
  std::vector<int> added;
  for (const dem::NewParticle &particle : particles)
    added.push_back(particle.index);
  std::vector<int> settling = added;
  settling.insert(settling.end(), reweighted.begin(), reweighted.end());
  Accelerations accelerations = project_accelerations(fem_side, packing, settling, comm);
  for (auto &[index, acceleration] : accelerations) // not of what a boundary holds
    for (int c = 0; c < 3; ++c)
      if (boundary.role(index).held || boundary.role(index).blocked[c])
        acceleration[c] = 0.;

  fem_side.set_weights(regions.fe_weights());
  dem_side->insert(particles);
  const std::vector<TiedParticle> ties = active_ties();
  constraint->set_particles(ties);
  relax_particles(added, reweighted, ties, accelerations);
  if (mode == Mode::adaptive)
    monitor.check(fem_side, regions, ties, dem_side->is_active(), cells, dt, *constraint);

  event.bonds_stored = bonds_between(added);
  audit_stress(event, stress, stresses_of(cells, true));
  close_event(event);
}

void CoupledModel::activate(std::vector<int> cells)
{
  std::sort(cells.begin(), cells.end());
  convert(cells);
}

void CoupledModel::return_to_continuum(std::vector<int> cells)
{
  if (cells.empty())
    return;
  std::sort(cells.begin(), cells.end());
  ActivationEvent event = open_event();
  event.cells = -static_cast<int>(cells.size());
  const CellStresses stress = stresses_of(cells, true);

  const Eigen::Matrix3Xd moved = fem_side.gather(fem::NodalField::mass);
  regions.restore(cells);
  fem_side.set_weights(regions.fe_weights());
  const NodalState state = recover_nodes(fem_side, *dem_side, packing, cells, moved, comm);
  fem_side.set_state(state.displacement, state.velocity);

  std::vector<int> unused;
  for (int i = 0; i < packing.size(); ++i)
    if (dem_side->is_active()[i] && !regions.needs_particle(i))
      unused.push_back(i);
  event.particles = -static_cast<int>(unused.size());
  event.bonds_stored = -bonds_between(unused);
  dem_side->remove(unused);
  const std::vector<TiedParticle> ties = active_ties();
  constraint->set_particles(ties);
  dem_side->set_weights(regions.de_weights());
  set_up_forces();
  if (mode == Mode::adaptive)
    monitor.check(fem_side, regions, ties, dem_side->is_active(), cells, dt, *constraint);
  audit_stress(event, stress, stresses_of(cells, false));
  close_event(event);
}

/// Stresses of cells as one of the sides has them.
CellStresses CoupledModel::stresses_of(const std::vector<int> &cells, bool of_particles)
{
  std::vector<char> target(fem_side.mesh().n_cells(), 0);
  for (const int cell : cells)
    target[cell] = 1;
  CellStresses stress = CellStresses::Zero(6, cells.size());
  if (of_particles)
  {
    const CellStresses all = virial_stress.stresses(target, fem_side, *dem_side, settings.rock.poisson);
    for (std::size_t k = 0; k < cells.size(); ++k)
      stress.col(k) = all.col(cells[k]);
    return stress;
  }
  const fem::CellStress local = fem_side.cell_stress();
  for (std::size_t k = 0; k < local.cell.size(); ++k)
    if (target[local.cell[k]])
      stress.col(std::lower_bound(cells.begin(), cells.end(), local.cell[k]) - cells.begin()) = local.sigma.col(k);
  MPI_Allreduce(MPI_IN_PLACE, stress.data(), static_cast<int>(stress.size()), MPI_DOUBLE, MPI_SUM, comm);
  return stress;
}

void CoupledModel::audit_stress(ActivationEvent &event, const CellStresses &before, const CellStresses &after) const
{
  const auto root_mean_square = [](const CellStresses &stress)
  { return std::sqrt((stress.topRows<3>().squaredNorm() + 2. * stress.bottomRows<3>().squaredNorm()) / stress.cols()); };
  event.stress = root_mean_square(before);
  event.stress_jump = root_mean_square(after - before);
}

/// Stored bonds of particles that come or go to active ones.
std::int64_t CoupledModel::bonds_between(const std::vector<int> &added) const
{
  std::vector<char> is_new(packing.size(), 0);
  for (const int i : added)
    is_new[i] = 1;
  std::int64_t bonds = 0;
  for (const int i : added)
    for (const int partner : regions.bonds().partners_of(i))
      bonds += dem_side->is_active()[partner] && (!is_new[partner] || i < partner);
  return bonds;
}

/// The ties of the present overlap to particles that did not leave the domain.
std::vector<TiedParticle> CoupledModel::active_ties() const
{
  std::vector<TiedParticle> ties;
  for (const TiedParticle &particle : boundary.movable(regions.tied_particles()))
    if (dem_side->is_active()[particle.index])
      ties.push_back(particle);
  return ties;
}

/// Gives the particles their weights and moves those of a random packing to places where they rest: the projected field is
/// smooth, they fluctuate about it, and let go they would ring and overload bonds. What accelerates them is not part of that:
/// it is the load of a passing wave. Velocities stay as projected.
void CoupledModel::relax_particles(const std::vector<int> &added, const std::vector<int> &reweighted,
                                   const std::vector<TiedParticle> &ties, const Accelerations &accelerations)
{
  const Tie tie = constraint->tie();
  // In mode dem particles start where bonds are at rest.
  const bool at_rest = settings.activation.relaxation_steps == 0 || (mode == Mode::dem && settings.initial_stress.norm() == 0.);
  std::vector<int> moving = added;
  if (tie == Tie::rigid)
  {
    std::vector<char> tied(packing.size(), 0);
    for (const TiedParticle &particle : ties)
      tied[particle.index] = 1;
    moving.erase(std::remove_if(moving.begin(), moving.end(), [&](int i) { return tied[i]; }), moving.end());
  }
  if (tie == Tie::mean)
  {
    // With full weights: the places of rest do not depend on how stiffness is shared, and weights would load particles with
    // forces that the finite elements balance. What was at rest in the old overlap is so no longer. The outermost particles
    // miss bonds and stay; so do damaged ones, whose contacts would take the move for sliding.
    moving.insert(moving.end(), reweighted.begin(), reweighted.end());
    const std::vector<char> damaged = damaged_particles();
    const auto stays = [&](int i)
    {
      const auto partners = regions.bonds().partners_of(i);
      return damaged[i] ||
             !std::all_of(partners.begin(), partners.end(), [&](int partner) { return dem_side->is_active()[partner]; });
    };
    moving.erase(std::remove_if(moving.begin(), moving.end(), stays), moving.end());
  }
  dem_side->set_weights(tie == Tie::mean && !at_rest ? Eigen::VectorXd(Eigen::VectorXd::Ones(packing.size()))
                                                     : regions.de_weights());
  relaxing = !at_rest;
  set_up_forces();
  if (!at_rest)
  {
    relax(
      settings, packing, moving, accelerations, *dem_side, [this] { particle_forces(&dem::DemSide::compute_forces); },
      [this] { return constraint->springs(); });
    relaxing = false;
    dem_side->set_weights(regions.de_weights());
    particle_forces(&dem::DemSide::compute_forces);
  }
}

/// By index in the packing: has a broken bond.
std::vector<char> CoupledModel::damaged_particles() const
{
  const dem::Particles particles = dem_side->particles();
  const std::vector<double> damage = dem_side->damage();
  std::vector<int> local;
  for (int i = 0; i < particles.n && i < static_cast<int>(damage.size()); ++i)
    if (damage[i] > 0.)
      local.push_back(particles.index[i]);
  std::vector<char> damaged(packing.size(), 0);
  for (const int index : gather_all(local, MPI_INT, comm))
    damaged[index] = 1;
  return damaged;
}

void CoupledModel::set_up_forces()
{
  particle_forces(&dem::DemSide::setup);
}

void CoupledModel::particle_forces(void (dem::DemSide::*compute)(const dem::ForceHook &))
{
  try
  {
    (dem_side.get()->*compute)([this](dem::Phase phase, dem::Particles &all) { cycle(phase, all); });
  }
  catch (const std::runtime_error &error)
  {
    throw UnstableRun("run became unstable near t = " + std::to_string(now) + " s: " + error.what());
  }
}

ToolForce CoupledModel::take_tool_force()
{
  ToolForce result;
  if (cutter.present() && impulse_duration > 0.)
    result.mean = -cutter.total(local_impulse).force / impulse_duration;
  local_impulse = Tool::Load();
  impulse_duration = 0.;
  return result;
}

EnergyLedger CoupledModel::energies() const
{
  const ConstraintEnergy tie = constraint->energy();
  double sums[7] = {
    tie.stored,          tie.dissipated,         tool_work.local(), boundary_work.local(), absorbing_work.local(),
    debris_work.local(), debris_contact.stored()};
  MPI_Allreduce(MPI_IN_PLACE, sums, 7, MPI_DOUBLE, MPI_SUM, comm);
  const dem::Energies particles = dem_side->energies();
  const fem::Energies continuum = fem_side.energies();
  EnergyLedger ledger;
  ledger.kinetic = particles.kinetic + continuum.kinetic;
  ledger.finite_step = particles.finite_step + continuum.finite_step;
  ledger.elastic = particles.elastic + continuum.elastic + sums[6];
  ledger.coupling = sums[0];
  ledger.interface = sums[1];
  ledger.damping = particles.damping;
  const double on_debris = sums[5] + continuum.surface[static_cast<int>(fem::SurfaceLoad::loose)];
  ledger.friction = particles.friction - on_debris - sums[6]; // what their contacts neither store nor give back
  ledger.released = particles.released;
  ledger.absorbed = continuum.absorbed - sums[4];
  ledger.tool_work = sums[2] + continuum.surface[static_cast<int>(fem::SurfaceLoad::tool)];
  ledger.boundary_work = continuum.boundary + sums[3];
  ledger.conversion = conversion_energy;
  ledger.initial = initial_energy;
  return ledger;
}
} // namespace kerf
