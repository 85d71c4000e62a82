// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/method/activation/relaxation.h"
#include "coupler/method/activation/virial_stress.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/conversion_audit.h"
#include "coupler/method/model_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/stability/stability_monitor.h"

#include <functional>
#include <vector>

namespace kerf
{
/// Converts cells between the two models, in both directions. The state is transferred by projection, so mass, momentum and
/// motion are kept as far as the fields of both models allow. Every conversion returns an audit.
class Conversion
{
public:
  /// Computes all forces of the model at the present positions.
  struct Forces
  {
    std::function<void()> set_up;  ///< after particles were inserted or removed
    std::function<void()> compute; ///< after particles were moved
    /// Stiffness of constraint and tool on this rank's particles, in their order at the last computation [N/m]; empty: none.
    std::function<Eigen::VectorXd()> springs;
  };

  /// All references are kept. @param dt time step [s]. @param energies returns the present energies of the model
  Conversion(const ModelSettings &settings, Mode mode, fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing,
             Overlap &overlap, Constraint &constraint, const ParticleBoundary &boundary, VirialStress &virial_stress, double dt,
             Forces forces, std::function<EnergyLedger()> energies, MPI_Comm comm);

  /// Converts @p cells (ascending) to particles, which relax for that many iterations. Throws UnstableRun when the time step is
  /// not stable in the new overlap. Collective.
  ActivationEvent convert(const std::vector<int> &cells, int relaxation_steps);

  /// Returns converted @p cells (ascending) to the continuum. Their bonds should be intact. Throws UnstableRun like convert().
  /// Collective.
  ActivationEvent return_to_continuum(const std::vector<int> &cells);

  /// Particles that the constraint ties to the finite elements since the last change of models.
  const std::vector<TiedParticle> &tied_particles() const { return ties; }

  /// Whether new particles are being relaxed. During relaxation time does not advance and only particles have forces.
  bool relaxing() const { return is_relaxing; }

private:
  ActivationEvent audit_before(const std::vector<int> &cells) const;
  void audit_after(ActivationEvent &event) const;
  CellStresses stresses_of(const std::vector<int> &cells, bool of_particles);
  std::int64_t bonds_between(const std::vector<int> &added) const;
  std::vector<TiedParticle> ties_of_rock(const std::vector<dem::StoredPair> &born_broken) const;
  void relax_particles(const std::vector<int> &added, const std::vector<int> &reweighted, const Accelerations &accelerations,
                       int relaxation_steps);
  std::vector<int> broken_counts() const;

  const ModelSettings &settings;
  Mode mode;
  fem::FemSide &fem;
  dem::DemSide &dem;
  const dem::Packing &packing;
  Overlap &overlap;
  Constraint &constraint;
  const ParticleBoundary &boundary;
  VirialStress &virial_stress;
  StabilityMonitor monitor;
  double dt;
  Forces forces;
  std::function<EnergyLedger()> energies;
  MPI_Comm comm;
  std::vector<TiedParticle> ties;
  bool is_relaxing = false;
};
} // namespace kerf
