// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/activation.h"
#include "coupler/case_file.h"
#include "coupler/constraint.h"
#include "coupler/outer_work.h"
#include "coupler/overlap.h"
#include "coupler/particle_boundary.h"
#include "coupler/particle_loads.h"
#include "coupler/step_timer.h"
#include "coupler/tool.h"

#include <memory>

namespace kerf
{
/// What one change of models did (audit, seed's "behaviours of both methods should be equivalent").
struct ActivationEvent
{
  std::int64_t step = 0;
  double time = 0.;
  int cells = 0;     ///< converted in this event
  int particles = 0; ///< taken from the store in this event
  Inventory before, after;
};

/// Energies of the coupled body [J], both sides weighted, so that they sum up without double counting.
struct EnergyLedger
{
  double kinetic = 0., elastic = 0., coupling = 0.;
  double finite_step = 0.; ///< of the particles, see dem::Energies
  double damping = 0., friction = 0., released = 0.;
  double boundary_work = 0., absorbed = 0.;
  double tool_work = 0.; ///< mode dem: force times the way of the particles; else force times the way of the tool

  /// used() - work() - energy at the start: what is missing in the balance. Only of mode dem, where all parts are known; else
  /// 0.
  double residual = 0.;

  double work() const { return tool_work + boundary_work; }
  double used() const { return kinetic + finite_step + elastic + coupling + damping + friction + released + absorbed; }
};

/// Mean force of the rock on the tool since the last call [N].
struct ToolForce
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
};

/// Both sides of one body and what ties them together. The cycle of a step is in cycle(); the README has it as a table.
class CoupledModel
{
public:
  /// @param fem, @param packing and @param settings are kept by reference. @param dt step of both sides [s]
  CoupledModel(const Case &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, double dt, MPI_Comm comm);

  /// Converts the cells that the mode asks for at time zero. Collective.
  void start();

  /// Advances by @p steps steps. Collective.
  void advance(int steps);

  /// Mode adaptive: converts cells whose stress passed sigma*. Returns whether anything changed. Collective.
  bool adapt();

  std::int64_t step() const { return n_steps; }
  double time() const { return now; }
  double time_step() const { return dt; }
  ToolForce take_tool_force();   ///< collective
  EnergyLedger energies() const; ///< collective

  fem::FemSide &fem() { return fem_side; }
  dem::DemSide &dem() { return *dem_side; }
  const dem::DemSide &dem() const { return *dem_side; }
  const Overlap &overlap() const { return regions; }
  const Tool &tool() const { return cutter; }
  const ActivationRule &rule() const { return activation; }
  const std::vector<ActivationEvent> &events() const { return activation_events; }
  int n_overlap_particles() const { return constraint->n_particles(); }
  StepTimer &timer() { return clock; }

private:
  void cycle(dem::Phase phase, dem::Particles &particles);
  void convert(const std::vector<int> &cells);
  void relax(const std::vector<dem::NewParticle> &fresh);

  const Case &settings;
  Mode mode;
  fem::FemSide &fem_side;
  const dem::Packing &packing;
  double dt;
  MPI_Comm comm;

  std::unique_ptr<dem::DemSide> dem_side;
  Overlap regions;
  ActivationRule activation;
  std::unique_ptr<Constraint> constraint;
  ParticleBoundary boundary;
  ParticleLoads loads;
  Tool cutter;
  OuterWork tool_work, boundary_work, absorbing_work; // on particles
  ForceCatcher tool_forces;

  std::int64_t n_steps = 0;
  double now = 0.;
  double local_coupling_energy = 0.;
  double energy_at_start = 0.; // of the initial stress [J]
  Tool::Load local_impulse;    // time integral of the tool's load since the last take_tool_force()
  double impulse_duration = 0.;
  double local_tool_work = 0., last_power = 0.; // over the way of the tool [J], [W]
  std::vector<ActivationEvent> activation_events;
  StepTimer clock;
};

/// Stable steps of both sides and of the coupled model [s].
struct StableSteps
{
  double fem = 0.;     ///< 2/omega_max of the finite elements
  double dem = 0.;     ///< 2/omega_max of the pack, bonded or broken, less contact damping
  double coupled = 0.; ///< largest step the run may use
};

/// Limits for a mode: the smaller of the sides that take part, lowered by the penalty, omega^2 dt^2 + beta <= 4.
StableSteps stable_steps(const Case &settings, Mode mode, const fem::FemSide &fem, const dem::Packing &packing);

/// Largest angular frequency of the particles, whole or broken [rad/s]. Broken rock has the stiffness of a bond in each contact
/// that sticks, and where it is pressed together particles have contacts they had no bonds for. So the network of all pairs
/// with a gap below half a mean radius counts, too: pressed together by that, more than 20 % of a diameter, all of them touch.
double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density);

/// What the particle side of a case is set up with.
dem::Settings particle_settings(const Case &settings, const dem::Packing &packing, double dt, MPI_Comm comm);

/// Density of a particle: rock density / solid fraction, so that both sides have the same mass [kg/m^3].
double particle_density(const Case &settings, const dem::Packing &packing);
} // namespace kerf
