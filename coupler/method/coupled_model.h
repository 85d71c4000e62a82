// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/energy/energy_ledger.h"
#include "coupler/energy/force_catcher.h"
#include "coupler/energy/particle_work.h"
#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/loading/boundary/particle_loads.h"
#include "coupler/loading/debris_contact.h"
#include "coupler/loading/tool/tool.h"
#include "coupler/method/activation/activation_rule.h"
#include "coupler/method/activation/return_rule.h"
#include "coupler/method/constraint/make_constraint.h"
#include "coupler/method/conversion.h"
#include "coupler/method/model_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/step_timer.h"

#include <memory>

namespace kerf
{
/// Mean force of the rock on the tool since the last call [N].
struct ToolForce
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
};

/// Both sides of one body and what ties them together. The cycle of a step is in cycle(); the README has it as a table.
class CoupledModel
{
public:
  /// @p fem, @p packing and @p settings are kept by reference. @param dt step of both sides [s]
  /// @param constraint of the settings (see constraint_model()); null: made here
  CoupledModel(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, double dt,
               MPI_Comm comm, std::unique_ptr<Constraint> constraint = nullptr);

  /// Converts the cells that the mode asks for at time zero. Collective.
  void start();

  /// Advances by @p steps steps. Collective.
  void advance(int steps);

  /// Mode adaptive: converts cells whose stress passed sigma*, or else gives quiet ones back (Adaptivity/Return fraction).
  /// Returns whether anything changed. Collective.
  bool adapt();

  /// Converts @p cells whatever their stress (studies). Collective.
  void activate(std::vector<int> cells);

  /// Makes converted @p cells finite elements again, whatever their state (studies): their bonds should be intact. Collective.
  void return_to_continuum(std::vector<int> cells);

  /// Computes the forces anew after positions were changed from outside. Collective.
  void set_up_forces();

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
  const DebrisContact &debris() const { return debris_contact; }
  const std::vector<ActivationEvent> &events() const { return activation_events; }
  int n_overlap_particles() const { return constraint->n_particles(); }
  StepTimer &timer() { return clock; }

private:
  void cycle(dem::Phase phase, dem::Particles &particles);
  /// Enters what came in with a change of models into the ledger.
  void record(ActivationEvent event);
  template <typename Action>
  void watched(const Action &action);
  void particle_forces(void (dem::DemSide::*compute)(const dem::ForceHook &));

  const ModelSettings &settings;
  Mode mode;
  fem::FemSide &fem_side;
  const dem::Packing &packing;
  double dt;
  MPI_Comm comm;

  std::unique_ptr<dem::DemSide> dem_side;
  Overlap regions;
  ActivationRule activation;
  VirialStress virial_stress;
  ReturnRule return_rule;
  ParticleBoundary boundary;
  ParticleLoads loads;
  std::unique_ptr<Constraint> constraint;
  Conversion conversion;
  Tool cutter;
  DebrisContact debris_contact;
  ParticleWork tool_work, debris_work, boundary_work, absorbing_work; // on particles
  ForceCatcher tool_forces;

  std::int64_t n_steps = 0;
  double now = 0.;
  double initial_energy = 0., conversion_energy = 0.; // see EnergyLedger
  Tool::Load local_impulse;                           // time integral of the tool's load since the last take_tool_force()
  double impulse_duration = 0.;
  std::vector<ActivationEvent> activation_events;
  StepTimer clock;
};

/// What the constraint of a model is made from; refers to @p packing.
ConstraintModel constraint_model(const ModelSettings &settings, const dem::Packing &packing, MPI_Comm comm);
/// What the particle side of a model is set up with.
dem::Settings particle_settings(const ModelSettings &settings, const dem::Packing &packing, double dt, MPI_Comm comm);
} // namespace kerf
