// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/method/activation/virial_stress.h"
#include "coupler/method/constraint/constraint.h"
#include "coupler/method/conversion_audit.h"
#include "coupler/method/model_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/stability/stability_monitor.h"

#include <functional>
#include <unordered_map>
#include <vector>

namespace kerf
{
/// Changes the model of cells: finite elements become particles, and particles finite elements again. Both sides keep mass,
/// momentum and motion as far as their fields allow; each change says what it did.
class Conversion
{
public:
  /// How the model makes the forces of all parts for the present positions.
  struct Forces
  {
    std::function<void()> set_up;  ///< after particles came or went
    std::function<void()> compute; ///< after particles were moved
  };

  /// All references are kept. @param dt step [s]. @param energies of the model at present
  Conversion(const ModelSettings &settings, Mode mode, fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing,
             Overlap &overlap, Constraint &constraint, const ParticleBoundary &boundary, VirialStress &virial_stress, double dt,
             Forces forces, std::function<EnergyLedger()> energies, MPI_Comm comm);

  /// Converts @p cells, ascending, to particles. Throws UnstableRun when the step is too large for the new overlap. Collective.
  ActivationEvent convert(const std::vector<int> &cells);

  /// Makes converted @p cells, ascending, finite elements again: their bonds should be intact. Throws UnstableRun likewise.
  /// Collective.
  ActivationEvent return_to_continuum(const std::vector<int> &cells);

  /// New particles are moved to rest at present: time stands still and only particles have forces.
  bool relaxing() const { return is_relaxing; }

private:
  using Accelerations = std::unordered_map<int, Eigen::Vector3d>;
  ActivationEvent open() const;
  void close(ActivationEvent &event) const;
  CellStresses stresses_of(const std::vector<int> &cells, bool of_particles);
  std::int64_t bonds_between(const std::vector<int> &added) const;
  std::vector<TiedParticle> active_ties() const;
  void relax_particles(const std::vector<int> &added, const std::vector<int> &reweighted, const std::vector<TiedParticle> &ties,
                       const Accelerations &accelerations);
  std::vector<char> damaged_particles() const;

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
  bool is_relaxing = false;
};
} // namespace kerf
