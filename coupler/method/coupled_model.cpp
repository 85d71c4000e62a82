// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/coupled_model.h"

#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/contact_criterion.h"
#include "coupler/method/stability/stable_step.h"
#include "dem_side/errors.h"

#include <algorithm>
#include <numeric>
#include <sstream>

namespace kerf
{
namespace
{
/// Under initial stress a region that converts at the start has no equilibrium to begin with. So it gets more iterations than a
/// few cells beside relaxed particles: as many as the skin of a block needs.
constexpr int relaxation_at_start = 20;
} // namespace

ConstraintModel constraint_model(const ModelSettings &settings, const dem::Packing &packing, MPI_Comm comm)
{
  return {settings.constraint, settings.overlap, settings.bond.k_n, settings.bond.k_t, settings.mean_diameter, &packing, comm};
}

dem::Settings particle_settings(const ModelSettings &settings, const dem::Packing &packing, double dt, MPI_Comm comm)
{
  dem::Settings result;
  result.comm = comm;
  result.packing = &packing;
  result.bond = settings.bond;
  result.density = packing.particle_density(settings.body.material.density);
  result.local_damping = settings.local_damping;
  result.time_step = dt;
  // The domain exceeds the rock by its height on every side, since fragments fly off.
  const Eigen::Vector3d extent = packing.upper - packing.lower;
  const double margin = std::max(extent[1], 0.5 * extent[0]);
  result.domain_lower = packing.lower.array() - margin;
  result.domain_upper = packing.upper.array() + margin;
  return result;
}

CoupledModel::CoupledModel(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, double dt,
                           MPI_Comm comm, std::unique_ptr<Constraint> given_constraint)
  : settings(settings), mode(mode), fem_side(fem), dt(dt), comm(comm),
    dem_side(std::make_unique<dem::DemSide>(particle_settings(settings, packing, dt, comm))),
    regions(fem.mesh(), fem.quadrature_points(), fem.surface_positions(), packing, settings.overlap.weight_function,
            settings.overlap.width),
    activation(settings.activation, settings.body.material, fem.mesh(), comm), virial_stress(fem.mesh(), packing, comm),
    return_rule(settings.activation, settings.body.material.poisson, fem.mesh(), packing, virial_stress, comm),
    boundary(fem.mesh(), settings.body.material, settings.body.boundary_conditions, packing, settings.body.surface_spacing),
    loads(settings.body, fem.mesh(), packing),
    surface(fem.mesh(), std::vector<char>(fem.mesh().boundary.size(), settings.tool.present()), packing,
            settings.body.surface_spacing),
    surface_shares(regions),
    constraint(given_constraint ? std::move(given_constraint) : make_constraint(constraint_model(settings, packing, comm))),
    conversion(
      settings, mode, fem, *dem_side, packing, regions, *constraint, boundary, virial_stress, dt,
      {[this] { set_up_forces(); }, [this] { particle_forces(&dem::DemSide::compute_forces); }, [this] { return springs(); }},
      [this] { return energies(); }, comm),
    cutter(settings.tool, packing.dim, settings.bond.k_n, packing.mean_diameter, settings.body.material.density, comm),
    debris_contact(settings.bond, packing, dt, comm), tool_work(dt, comm), debris_work(dt, comm), boundary_work(dt, comm),
    absorbing_work(dt, comm)
{
  constraint->set_time_step(dt);
  cutter.hold(packing);
  // A surface node has the lumped mass of half a cell. Finer cells than particles take less.
  cutter.set_time_step(dt, std::min(packing.mean_diameter, 0.5 * smallest_edge(fem.mesh())));
  for (std::vector<TributaryAreas> *list : {&loads.loaded_areas(), &boundary.absorbing_areas()})
    for (TributaryAreas &areas : *list)
      surface_shares.add(areas);
  surface_shares.add(surface);
}

void CoupledModel::update_surface_loads()
{
  if (!surface_shares.update(conversion.relaxing() && constraint->tie() == Tie::mean))
    return;
  cutter.set_contact_weights(surface.mean_weights());
  loads.update_forces();
  boundary.update_dashpots();
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
  else if (mode == Mode::adaptive)
    cells = activation.cells_below_tool(regions, cells_near_tool());
  fem_side.compute_forces();
  if (!cells.empty())
  {
    clock.begin_whole(Part::activation);
    const int repeats = settings.body.initial_stress.norm() > 0. ? relaxation_at_start : 1;
    record(conversion.convert(cells, repeats * settings.activation.relaxation_steps));
    clock.end_whole();
  }
  conversion_energy = conversion_gain = 0.; // the conversion at the start defines the initial energy
  const EnergyLedger ledger = energies();
  initial_energy = ledger.held() + ledger.lost() - ledger.work();
}

void CoupledModel::cycle(dem::Phase phase, dem::Particles &particles)
{
  clock.lap(Part::dem);
  const bool with_fem = fem_side.n_active_cells() > 0 && !conversion.relaxing();
  const bool stepping = phase == dem::Phase::step;
  if (stepping)
  {
    ++n_steps;
    now = n_steps * dt;
  }
  for (ParticleWork *work : {&tool_work, &debris_work, &boundary_work, &absorbing_work})
    work->begin(phase, particles);
  update_surface_loads();

  if (with_fem)
  {
    if (stepping)
      fem_side.begin_step(dt, now); // the particles are already at their new positions
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

  if (!conversion.relaxing() || constraint->tie() == Tie::spring)
    constraint->apply(phase, particles, fem_side); // after all other forces, which its multipliers need
  clock.lap(Part::exchange);

  boundary.hold(particles, now, dt, boundary_work);
  clock.lap(Part::dem);
  if (with_fem && stepping)
    fem_side.end_step(dt, now);
  clock.lap(Part::fem); // the second half kick of the particles follows when the hook returns
}

/// Reports a diverging side as an unstable run. Either side detects divergence on all ranks before the energies are checked.
/// Other errors do not come from the physics and pass through.
template <typename Action>
void CoupledModel::with_runaway_reported(const Action &action)
{
  const auto unstable = [this](const std::exception &error)
  {
    std::ostringstream text;
    text << "run became unstable near t = " << now << " s: " << error.what();
    return UnstableRun(text.str());
  };
  try
  {
    action();
  }
  catch (const dem::Unstable &error)
  {
    throw unstable(error);
  }
  catch (const fem::Unstable &error)
  {
    throw unstable(error);
  }
}

void CoupledModel::advance(int steps)
{
  clock.restart();
  with_runaway_reported(
    [&]
    {
      dem_side->advance(steps, [this](dem::Phase phase, dem::Particles &all) { cycle(phase, all); });
      fem_side.check_motion(); // blocks of steps end at every row of the history and at the end of the run
    });
  if (fem_side.n_active_cells() > 0)
    debris_contact.find_debris(*dem_side, regions.bonds(), conversion.tied_particles());
  clock.lap(Part::dem);
}

bool CoupledModel::adapt()
{
  if (mode != Mode::adaptive)
    return false;
  clock.begin_whole(Part::activation);
  const std::size_t n_events = activation_events.size();
  if (const std::vector<int> cells = activation.cells_to_convert(fem_side, regions, cells_near_tool()); !cells.empty())
    record(conversion.convert(cells, settings.activation.relaxation_steps));
  else if (return_rule.due(now))
    return_to_continuum(return_rule.cells_to_return(fem_side, regions, *dem_side, now, cells_kept_below_tool()));
  clock.end_whole();
  return activation_events.size() > n_events;
}

/// Cells of this rank that the tool may touch before the next check. Particles stand off the surface by less than a diameter.
std::vector<NearCell> CoupledModel::cells_near_tool() const
{
  if (!cutter.present())
    return {};
  return cutter.near_cells(fem_side, settings.mean_diameter, settings.activation.check_interval * dt);
}

/// Cells that would be converted again before contact if they returned.
std::vector<int> CoupledModel::cells_kept_below_tool() const
{
  if (!cutter.present() || !settings.activation.by_contact)
    return {};
  return cells_too_coarse_for_contact(
    cutter.near_cells(fem_side.mesh(), settings.mean_diameter, settings.activation.return_time),
    settings.activation.compressive_strength, settings.body.material, fem_side.mesh());
}

void CoupledModel::activate(std::vector<int> cells)
{
  std::sort(cells.begin(), cells.end());
  record(conversion.convert(cells, settings.activation.relaxation_steps));
}

void CoupledModel::return_to_continuum(std::vector<int> cells)
{
  if (cells.empty())
    return;
  std::sort(cells.begin(), cells.end());
  record(conversion.return_to_continuum(cells));
}

void CoupledModel::record(ActivationEvent event)
{
  event.step = n_steps;
  event.time = now;
  conversion_energy -= event.held_before;
  conversion_energy += event.held_after;
  conversion_gain += std::max(0., event.held_after - event.held_before);
  activation_events.push_back(event);
}

void CoupledModel::set_up_forces()
{
  particle_forces(&dem::DemSide::setup);
}

Eigen::VectorXd CoupledModel::springs() const
{
  Eigen::VectorXd stiffness = constraint->springs();
  if (stiffness.size() == 0 && !cutter.touched().empty())
    stiffness = Eigen::VectorXd::Zero(dem_side->particles().n);
  for (std::size_t k = 0; k < cutter.touched().size(); ++k)
    stiffness[cutter.touched()[k]] += cutter.touched_stiffness()[k];
  return stiffness;
}

void CoupledModel::particle_forces(void (dem::DemSide::*compute)(const dem::ForceHook &))
{
  with_runaway_reported([&]
                        { (dem_side.get()->*compute)([this](dem::Phase phase, dem::Particles &all) { cycle(phase, all); }); });
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
  const double on_debris = sums[5] + continuum.surface[static_cast<int>(fem::SurfaceLoad::debris)];
  ledger.friction = particles.friction - on_debris - sums[6]; // without the energy stored in debris contacts
  ledger.released = particles.released;
  ledger.absorbed = continuum.absorbed - sums[4];
  ledger.left = particles.left;
  ledger.tool_work = sums[2] + continuum.surface[static_cast<int>(fem::SurfaceLoad::tool)];
  ledger.boundary_work = continuum.boundary + sums[3];
  ledger.conversion = conversion_energy;
  ledger.conversion_gain = conversion_gain;
  ledger.initial = initial_energy;
  return ledger;
}
} // namespace kerf
