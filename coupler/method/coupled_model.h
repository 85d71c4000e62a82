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
#include "coupler/method/surface_shares.h"

#include <memory>

namespace kerf
{
/// Mean force that the rock exerts on the tool since the last call [N].
struct ToolForce
{
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
};

/// The coupled model: finite elements, particles, the overlap with its constraint, and the loading. The order of operations in
/// a step is in cycle(); the README lists it as a table.
class CoupledModel
{
public:
  /// @p fem, @p packing and @p settings are kept by reference. @param dt time step of both sides [s]
  /// @param constraint that the settings name (see constraint_model()); null: the constructor makes it
  CoupledModel(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, double dt,
               MPI_Comm comm, std::unique_ptr<Constraint> constraint = nullptr);

  /// Converts the cells that the mode prescribes at time zero. Collective.
  void start();

  /// Advances by @p steps time steps. Collective.
  void advance(int steps);

  /// In mode adaptive, converts the cells whose stress exceeds sigma* and those that the tool is about to touch. If there are
  /// none, unloaded particle cells return to the continuum (Adaptivity/Return fraction). Returns whether cells were converted
  /// in either direction. Collective.
  bool adapt();

  /// Converts @p cells to particles regardless of their stress, for studies. Collective.
  void activate(std::vector<int> cells);

  /// Returns converted @p cells to the continuum regardless of their state, for studies. Their bonds should be intact.
  /// Collective.
  void return_to_continuum(std::vector<int> cells);

  /// Recomputes the forces after a caller changed positions. Collective.
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
  std::vector<NearCell> cells_near_tool() const;
  std::vector<int> cells_kept_below_tool() const;
  void cycle(dem::Phase phase, dem::Particles &particles);
  /// Loads on the surface have the weights of the places where they act.
  void update_surface_loads();
  /// Stiffness of constraint and tool on the particles, see Conversion::Forces.
  Eigen::VectorXd springs() const;
  /// Enters the energy change of a conversion into the ledger.
  void record(ActivationEvent event);
  template <typename Action>
  void with_runaway_reported(const Action &action);
  void particle_forces(void (dem::DemSide::*compute)(const dem::ForceHook &));

  const ModelSettings &settings;
  Mode mode;
  fem::FemSide &fem_side;
  double dt;
  MPI_Comm comm;

  std::unique_ptr<dem::DemSide> dem_side;
  Overlap regions;
  ActivationRule activation;
  VirialStress virial_stress;
  ReturnRule return_rule;
  ParticleBoundary boundary;
  ParticleLoads loads;
  TributaryAreas surface; // of the whole boundary, for contact
  SurfaceShares surface_shares;
  std::unique_ptr<Constraint> constraint;
  Conversion conversion;
  Tool cutter;
  DebrisContact debris_contact;
  ParticleWork tool_work, debris_work, boundary_work, absorbing_work; // work on the particles [J]
  ForceCatcher tool_forces;

  std::int64_t n_steps = 0;
  double now = 0.;
  double initial_energy = 0., conversion_energy = 0., conversion_gain = 0.; // see EnergyLedger
  Tool::Load local_impulse; // time integral of the load on this rank's part since the last take_tool_force()
  double impulse_duration = 0.;
  std::vector<ActivationEvent> activation_events;
  StepTimer clock;
};

/// Parameters from which the constraint of a model is made. They refer to @p packing.
ConstraintModel constraint_model(const ModelSettings &settings, const dem::Packing &packing, MPI_Comm comm);
/// Settings of the particle side of a model.
dem::Settings particle_settings(const ModelSettings &settings, const dem::Packing &packing, double dt, MPI_Comm comm);
} // namespace kerf
