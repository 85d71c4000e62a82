// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/model_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/stability/coupled_operator.h"

#include <memory>

namespace kerf
{
/// Stable steps of both sides and of the coupled model [s].
struct StableSteps
{
  double fem = 0.; ///< 2/omega_max of the finite elements, with the contact stiffness of the tool
  /// Of the particles, bonded or broken, with the contact damping of a pair of mean particles and the contact stiffness of the
  /// tool.
  double dem = 0.;
  /// Smallest limit of the sides and of the weighted, constrained model, damped like dem. Time/Safety is a fraction of it.
  double reference = 0.;
  /// Largest step that a run may use: with the dashpots of every pair, local damping and the contact of the tool.
  double coupled = 0.;
  double overlap = 0.;             ///< the same for the model around the overlap alone; 0: not computed
  Refusal refusal = Refusal::none; ///< reason why no step is stable
};

/// Stable steps of a mode: the smallest limit of the active sides and of the overlap. In mode fixed the overlap is known, and
/// the eigenvalue of its operator is computed. In mode adaptive the overlap is not known before the run, so the limit of the
/// sides is reduced by the bound omega^2 dt^2 + beta <= 4 of the constraint. Constant springs do not scale with the masses; for
/// them the operator of an overlap in the middle of the mesh is evaluated too. During the run StabilityMonitor evaluates the
/// operator of the real overlap after each conversion. Leaves the weights of @p fem at one. When no step is stable, the refusal
/// gives the reason. Collective. Theory (8.6) - (8.14).
StableSteps stable_steps(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                         Constraint &constraint, MPI_Comm comm);

/// Bond stiffnesses, damping and density of the particles, for NetworkOperator.
dem::NetworkOperator::Material bond_material(const ModelSettings &settings, const dem::Packing &packing);

/// Shortest edge of all cells [m].
double smallest_edge(const fem::Mesh &mesh);

/// Largest angular frequency of the particles in intact or broken rock [rad/s]. In broken rock every sticking contact has the
/// stiffness of a bond, and compressed particles have contacts without a former bond. So the frequency is the larger one of the
/// bond network and of the network of all pairs with a gap below half a mean radius.
double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density);
} // namespace kerf
