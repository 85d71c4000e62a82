// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/coupled_model.h"

#include "coupler/input_error.h"
#include "dem_side/bond_network.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <unordered_map>

namespace kerf
{
namespace
{
std::unique_ptr<Constraint> make_constraint(const Case &settings, const dem::Packing &packing, double dt, MPI_Comm comm)
{
  PenaltyConstraint::Settings penalty;
  penalty.comm = comm;
  penalty.mass_scaled = settings.constraint == ConstraintMethod::penalty_mass_scaled;
  penalty.beta = settings.penalty_ratio;
  penalty.stiffness = settings.penalty_ratio * settings.bond.k_n;
  penalty.time_step = dt;
  return std::make_unique<PenaltyConstraint>(penalty, packing.positions, packing.periodic);
}
/// Stable step of a system that gets a further spring: omega^2 is at most the sum.
double with_spring(double step, double omega2)
{
  return 2. / std::sqrt(4. / (step * step) + omega2);
}

int lightest_particle(const dem::Packing &packing)
{
  int lightest = 0;
  packing.radii.minCoeff(&lightest);
  return lightest;
}

double smallest_edge(const fem::Mesh &mesh)
{
  double smallest = 1e300;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int c = 0; c < mesh.dim; ++c) // lexicographic: the neighbours of corner 0 are 1, 2 and 4
      smallest = std::min(smallest, (mesh.nodes.col(mesh.cells(1 << c, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return smallest;
}

/// Stable step when the tool's spring touches the mesh: 2 k_s/(rho h) of a surface node (area a, lumped mass rho a h/2),
/// whatever the cell's shape.
double with_tool_on_surface(const double step, const Case &settings, const fem::Mesh &mesh)
{
  if (!settings.tool.present())
    return step;
  const double k = settings.tool.stiffness_ratio * settings.bond.k_n;
  return with_spring(step, 2. * k / settings.packing.mean_diameter / (settings.rock.density * smallest_edge(mesh)));
}
} // namespace

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
                           MPI_Comm comm)
  : settings(settings), mode(mode), fem_side(fem), packing(packing), dt(dt), comm(comm),
    dem_side(std::make_unique<dem::DemSide>(particle_settings(settings, packing, dt, comm))),
    regions(fem.mesh(), fem.quadrature_points(), packing.positions, settings.weight_function, settings.overlap_width),
    activation(settings, fem.mesh(), comm), constraint(make_constraint(settings, packing, dt, comm)),
    boundary(fem.mesh(), settings.rock, settings.boundary_conditions, packing), loads(settings, fem.mesh(), packing),
    cutter(settings.tool, settings.bond.k_n, packing.mean_diameter, settings.rock.density, comm), tool_work(dt, comm),
    boundary_work(dt, comm), absorbing_work(dt, comm)
{
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
    convert(cells);
  const EnergyLedger ledger = energies();
  energy_at_start = ledger.used() - ledger.work();
}

void CoupledModel::cycle(dem::Phase phase, dem::Particles &particles)
{
  clock.lap(Part::dem);
  const bool with_fem = fem_side.n_active_cells() > 0;
  const bool stepping = phase == dem::Phase::step;
  if (stepping)
  {
    ++n_steps;
    now = n_steps * dt;
  }
  for (OuterWork *work : {&tool_work, &boundary_work, &absorbing_work})
    work->begin(phase, particles);

  if (with_fem)
  {
    if (stepping)
      fem_side.begin_step(dt, now); // the particles have drifted already
    fem_side.compute_forces();
  }
  clock.lap(Part::fem);

  local_coupling_energy = constraint->apply(particles, fem_side);
  clock.lap(Part::exchange);

  if (cutter.present())
  {
    if (stepping)
      cutter.move_to(now);
    cutter.apply(tool_forces.catch_forces(particles), fem_side);
    tool_forces.release(particles, tool_work);
    const Tool::Load &load = cutter.local_load();
    if (stepping)
    {
      local_impulse.force += dt * load.force;
      impulse_duration += dt;
      local_tool_work += 0.5 * dt * (last_power + load.power);
    }
    last_power = load.power;
  }
  clock.lap(Part::tool);

  loads.apply(particles, now, boundary_work);
  boundary.apply(particles, now, dt, boundary_work, absorbing_work);
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
  clock.lap(Part::dem);
}

bool CoupledModel::adapt()
{
  if (mode != Mode::adaptive)
    return false;
  clock.restart();
  const std::vector<int> cells = activation.cells_to_convert(fem_side, regions);
  if (!cells.empty())
    convert(cells);
  clock.lap(Part::activation);
  return !cells.empty();
}

void CoupledModel::convert(const std::vector<int> &cells)
{
  ActivationEvent event;
  event.step = n_steps;
  event.time = now;
  event.before = take_inventory(fem_side, *dem_side, comm);
  event.cells = static_cast<int>(cells.size());

  regions.convert(cells);
  // Project while the finite elements still carry the field everywhere.
  const std::vector<dem::NewParticle> particles = project(fem_side, regions, packing, dem_side->is_active(), comm);
  event.particles = static_cast<int>(particles.size());

  fem_side.set_weights(regions.fe_weights());
  dem_side->insert(particles);
  dem_side->set_weights(regions.de_weights());

  std::vector<int> constrained;
  for (int i = 0; i < packing.size(); ++i)
    if (regions.is_constrained(i) && dem_side->is_active()[i])
      constrained.push_back(i);
  constraint->set_particles(constrained);
  dem_side->setup([this](dem::Phase phase, dem::Particles &all) { cycle(phase, all); });
  if (mode != Mode::dem || settings.initial_stress.norm() > 0.) // else particles start where bonds are at rest
    relax(particles);

  event.after = take_inventory(fem_side, *dem_side, comm);
  activation_events.push_back(event);
}

/// The projected field is smooth, but particles of a random packing rest at places that fluctuate about it: let go, the excess
/// of elastic energy would ring and overload bonds. So the new particles are moved to rest among frozen neighbours before time
/// goes on; velocities stay as projected, bonds do not break meanwhile. Heavy-ball iteration with the diagonal of the bond
/// stiffness: step 0.9, memory 0.55 converges for eigenvalues of D^-1 K up to 2 (0.9 x 2 < 2 (1 + 0.55)).
void CoupledModel::relax(const std::vector<dem::NewParticle> &fresh)
{
  constexpr double step = 0.9, memory = 0.55;
  using Move = Eigen::Matrix<double, 6, 1>; // displacement, rotation
  std::unordered_map<int, Move> moves;
  for (const dem::NewParticle &particle : fresh)
    moves[particle.index] = Move::Zero();
  const double density = particle_density(settings, packing), k_n = settings.bond.k_n, k_t = settings.bond.k_t;

  for (int iteration = 0; iteration < (fresh.empty() ? 0 : settings.relaxation_steps); ++iteration)
  {
    dem::Particles particles = dem_side->particles();
    for (int i = 0; i < particles.n; ++i)
    {
      const auto found = moves.find(particles.index[i]);
      if (found == moves.end())
        continue;
      // Of n contacts half look along each direction; the weighted mass carries the mean contact weight.
      const double contacts = packing.coordination() * particles.mass[i] / (density * packing.volume(particles.index[i]));
      const double radius = particles.radius[i];
      Move &move = found->second;
      move *= memory;
      move.head<3>() += step / (0.5 * contacts * (k_n + k_t)) * particles.force.col(i);
      move.tail<3>() += step / (contacts * k_t * radius * radius) * particles.torque.col(i);
      particles.position.col(i) += move.head<3>();
      Eigen::Map<Eigen::Vector4d> stored(particles.rotation + 4 * i); // (w, x, y, z), turned by a small angle
      const Eigen::Quaterniond turned = Eigen::Quaterniond(1., 0.5 * move[3], 0.5 * move[4], 0.5 * move[5]) *
                                        Eigen::Quaterniond(stored[0], stored[1], stored[2], stored[3]);
      stored = Eigen::Vector4d(turned.w(), turned.x(), turned.y(), turned.z()).normalized();
    }
    dem_side->setup([this](dem::Phase phase, dem::Particles &all) { cycle(phase, all); });
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
  EnergyLedger ledger;
  double sums[4] = {local_coupling_energy, mode == Mode::dem ? tool_work.local() : local_tool_work, boundary_work.local(),
                    absorbing_work.local()};
  MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, comm);
  const dem::Energies particles = dem_side->energies();
  const fem::Energies continuum = fem_side.energies();
  ledger.kinetic = particles.kinetic + continuum.kinetic;
  ledger.elastic = particles.elastic + continuum.elastic;
  ledger.coupling = sums[0];
  ledger.tool_work = sums[1];
  ledger.damping = particles.damping;
  ledger.friction = particles.friction;
  ledger.released = particles.released;
  ledger.finite_step = particles.finite_step;
  ledger.boundary_work = continuum.boundary + sums[2];
  ledger.absorbed = continuum.absorbed - sums[3];
  ledger.residual = mode == Mode::dem ? ledger.used() - ledger.work() - energy_at_start : 0.;
  return ledger;
}

double particle_density(const Case &settings, const dem::Packing &packing)
{
  return settings.rock.density / packing.solid_fraction();
}

double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density)
{
  constexpr double pressed = 0.5; // gap / mean radius of pairs that touch where the rock is pressed together
  dem::Packing contacts = packing;
  dem::bond_by_gap(contacts, std::max(pressed, packing.gap_tolerance));
  return std::max(dem::largest_frequency(packing, k_n, k_t, density), dem::largest_frequency(contacts, k_n, k_t, density));
}

StableSteps stable_steps(const Case &settings, Mode mode, const fem::FemSide &fem, const dem::Packing &packing)
{
  StableSteps steps;
  steps.fem = fem.stable_step();
  if (mode == Mode::fem)
  {
    steps.dem = std::numeric_limits<double>::infinity();
    steps.coupled = steps.fem = with_tool_on_surface(steps.fem, settings, fem.mesh());
    return steps;
  }
  const double density = particle_density(settings, packing);
  const double omega = particle_frequency(packing, settings.bond.k_n, settings.bond.k_t, density);
  // Contact damping is a fraction xi of critical for a pair; the highest mode of the pack sees it through more contacts,
  // xi_max = xi omega_max sqrt(m/(2 k_n)). Limit with damping: (2/omega) (sqrt(1 + xi^2) - xi).
  double mass = 0.;
  for (int i = 0; i < packing.size(); ++i)
    mass += density * packing.volume(i) / packing.size();
  const double xi = settings.bond.damping * omega * std::sqrt(mass / (2. * settings.bond.k_n));
  steps.dem = 2. / omega * (std::sqrt(1. + xi * xi) - xi);

  if (settings.tool.present())
  {
    // The tool's spring adds to the stiffness of what it touches: k/m of the lightest particle.
    const double k = settings.tool.stiffness_ratio * settings.bond.k_n;
    const double lightest = density * packing.volume(lightest_particle(packing));
    steps.dem = with_spring(steps.dem, k / lightest);
    steps.fem = with_tool_on_surface(steps.fem, settings, fem.mesh());
  }

  const bool coupled = mode == Mode::adaptive || mode == Mode::fixed;
  double limit = mode == Mode::dem ? steps.dem : std::min(steps.fem, steps.dem);
  if (coupled && settings.constraint == ConstraintMethod::penalty_mass_scaled)
  {
    if (settings.penalty_ratio >= 2.)
      throw InputError(settings.directory + "/case.prm: Coupling/Penalty ratio = " + std::to_string(settings.penalty_ratio) +
                       " is unstable at any time step with Coupling/Method = penalty_mass_scaled, give less than 2 "
                       "(0.25 is safe)");
    limit *= std::sqrt(1. - 0.25 * settings.penalty_ratio);
  }
  else if (coupled)
  {
    // The lightest constrained particle: outermost row of the overlap, weight about d/(2 L_o).
    const double lightest = mass * 0.5 * packing.mean_diameter / std::max(settings.overlap_width, packing.mean_diameter);
    const double penalty_omega2 = settings.penalty_ratio * settings.bond.k_n / lightest;
    limit = with_spring(limit, penalty_omega2);
  }
  steps.coupled = limit;
  return steps;
}
} // namespace kerf
