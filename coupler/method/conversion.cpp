// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/conversion.h"

#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/relaxation.h"
#include "coupler/method/activation/state_transfer.h"
#include "coupler/method/stability/stable_step.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace kerf
{
Conversion::Conversion(const ModelSettings &settings, Mode mode, fem::FemSide &fem, dem::DemSide &dem,
                       const dem::Packing &packing, Overlap &overlap, Constraint &constraint, const ParticleBoundary &boundary,
                       VirialStress &virial_stress, double dt, Forces forces, std::function<EnergyLedger()> energies,
                       MPI_Comm comm)
  : settings(settings), mode(mode), fem(fem), dem(dem), packing(packing), overlap(overlap), constraint(constraint),
    boundary(boundary), virial_stress(virial_stress), monitor(settings, packing, comm), dt(dt), forces(std::move(forces)),
    energies(std::move(energies)), comm(comm)
{
}

ActivationEvent Conversion::audit_before(const std::vector<int> &cells) const
{
  ActivationEvent event;
  for (const int cell : cells)
    event.place += cell_centre(fem.mesh(), cell) / static_cast<double>(cells.size());
  const EnergyLedger ledger = energies();
  event.held_before = ledger.held() + ledger.left;
  event.before = conserved_quantities(fem, dem, ledger, comm);
  return event;
}

void Conversion::audit_after(ActivationEvent &event) const
{
  const EnergyLedger ledger = energies();
  event.held_after = ledger.held() + ledger.left;
  event.after = conserved_quantities(fem, dem, ledger, comm);
}

ActivationEvent Conversion::convert(const std::vector<int> &cells, const int relaxation_steps)
{
  ActivationEvent event = audit_before(cells);
  event.cells = static_cast<int>(cells.size());
  const CellStresses stress = stresses_of(cells, false);

  std::vector<std::pair<int, double>> weights; // of tied particles, if the constraint acts on means
  if (constraint.tie() == Tie::mean)
    for (const TiedParticle &particle : ties)
      weights.emplace_back(particle.index, overlap.de_weights()[particle.index]);
  overlap.convert(cells);
  std::vector<int> reweighted;
  for (const auto &[index, weight] : weights)
    if (overlap.de_weights()[index] != weight)
      reweighted.push_back(index);
  // Project before the weights change: the finite elements still carry the field everywhere.
  std::vector<dem::NewParticle> particles = project(fem, overlap, packing, dem.is_taken(), comm);
  constraint.place(particles, fem);
  const std::vector<dem::StoredPair> broken = broken_at_birth(particles, fem, dem, packing, overlap.bonds(), comm);
  event.bonds_born_broken = static_cast<std::int64_t>(broken.size());
  event.particles = static_cast<int>(particles.size());
  std::vector<int> added;
  for (const dem::NewParticle &particle : particles)
    added.push_back(particle.index);
  std::vector<int> to_relax = added;
  to_relax.insert(to_relax.end(), reweighted.begin(), reweighted.end());
  const auto is_held = [this](int index, int axis) { return boundary.role(index).held || boundary.role(index).blocked[axis]; };
  Accelerations accelerations = project_accelerations(fem, packing, to_relax, comm);
  for (auto &[index, acceleration] : accelerations) // none in directions that a boundary condition holds
    for (int c = 0; c < 3; ++c)
      if (is_held(index, c))
        acceleration[c] = 0.;

  dem.prepare_weights(overlap.de_weights());
  take_momentum_of_growth(particles, is_held, fem, dem, packing, overlap, comm);

  fem.set_weights(overlap.fe_weights(), overlap.fe_surface_weights());
  dem.insert(particles, broken);
  ties = ties_of_rock(broken);
  constraint.set_particles(ties);
  relax_particles(added, reweighted, accelerations, relaxation_steps);
  if (mode == Mode::adaptive)
    monitor.check(fem, overlap, ties, dem.is_active(), cells, dt, constraint);

  event.bonds_stored = bonds_between(added);
  compare_stresses(event, stress, stresses_of(cells, true));
  audit_after(event);
  return event;
}

ActivationEvent Conversion::return_to_continuum(const std::vector<int> &cells)
{
  ActivationEvent event = audit_before(cells);
  event.cells = -static_cast<int>(cells.size());
  const CellStresses stress = stresses_of(cells, true);

  const Eigen::Matrix3Xd mass_before = fem.gather(fem::NodalField::mass);
  overlap.restore(cells);
  fem.set_weights(overlap.fe_weights(), overlap.fe_surface_weights());
  const NodalState state = recover_nodes(fem, dem, packing, cells, mass_before, comm);
  fem.set_state(state.displacement, state.velocity);

  std::vector<int> unused;
  for (int i = 0; i < packing.size(); ++i)
    if (dem.is_active()[i] && !overlap.needs_particle(i))
      unused.push_back(i);
  dem.prepare_weights(overlap.de_weights(), unused);
  event.particles = -static_cast<int>(unused.size());
  event.bonds_stored = -bonds_between(unused);
  dem.remove(unused);
  ties = ties_of_rock({});
  constraint.set_particles(ties);
  dem.set_weights(overlap.de_weights());
  forces.set_up();
  if (mode == Mode::adaptive)
    monitor.check(fem, overlap, ties, dem.is_active(), cells, dt, constraint);
  compare_stresses(event, stress, stresses_of(cells, false));
  audit_after(event);
  return event;
}

/// Stresses of cells by one of the two models.
CellStresses Conversion::stresses_of(const std::vector<int> &cells, bool of_particles)
{
  std::vector<char> target(fem.mesh().n_cells(), 0);
  for (const int cell : cells)
    target[cell] = 1;
  CellStresses stress = CellStresses::Zero(6, cells.size());
  if (of_particles)
  {
    const CellStresses all = virial_stress.stresses(target, fem, dem, settings.body.material.poisson);
    for (std::size_t k = 0; k < cells.size(); ++k)
      stress.col(k) = all.col(cells[k]);
    return stress;
  }
  const fem::CellStress local = fem.cell_stress();
  for (std::size_t k = 0; k < local.cell.size(); ++k)
    if (target[local.cell[k]])
      stress.col(std::lower_bound(cells.begin(), cells.end(), local.cell[k]) - cells.begin()) = local.sigma.col(k);
  MPI_Allreduce(MPI_IN_PLACE, stress.data(), static_cast<int>(stress.size()), MPI_DOUBLE, MPI_SUM, comm);
  return stress;
}

/// Number of stored bonds between inserted or removed particles and active ones.
std::int64_t Conversion::bonds_between(const std::vector<int> &added) const
{
  std::vector<char> is_new(packing.size(), 0);
  for (const int i : added)
    is_new[i] = 1;
  std::int64_t bonds = 0;
  for (const int i : added)
    for (const int partner : overlap.bonds().partners_of(i))
      bonds += dem.is_active()[partner] && (!is_new[partner] || i < partner);
  return bonds;
}

/// Tied particles of the present overlap that are still part of the rock. Those that left the domain are not, nor those without
/// an intact bond when the bonds @p born_broken are broken, too. A spring that holds such a particle to the place that it came
/// from would gain energy with its weight.
std::vector<TiedParticle> Conversion::ties_of_rock(const std::vector<dem::StoredPair> &born_broken) const
{
  std::vector<int> broken = broken_counts();
  for (const auto &[first, second] : born_broken)
  {
    ++broken[first];
    ++broken[second];
  }
  const auto is_loose = [&](int i)
  {
    const auto partners = overlap.bonds().partners_of(i);
    return broken[i] > 0 &&
           broken[i] >= std::count_if(partners.begin(), partners.end(), [&](int j) { return dem.is_active()[j]; });
  };
  std::vector<TiedParticle> result;
  for (const TiedParticle &particle : boundary.movable(overlap.tied_particles()))
    if (dem.is_active()[particle.index] && !is_loose(particle.index))
      result.push_back(particle);
  return result;
}

/// Sets the weights of the particles and moves the particles of a random packing to equilibrium. The projected field is smooth,
/// but the equilibrium positions fluctuate about it. Without relaxation the particles would oscillate and overload bonds. The
/// acceleration of the finite elements is kept, since it belongs to a passing wave. Velocities stay as projected.
void Conversion::relax_particles(const std::vector<int> &added, const std::vector<int> &reweighted,
                                 const Accelerations &accelerations, const int relaxation_steps)
{
  const Tie tie = constraint.tie();
  // In mode dem without initial stress particles start with bonds free of force.
  const bool at_rest = relaxation_steps == 0 || (mode == Mode::dem && settings.body.initial_stress.norm() == 0.);
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
    // Relax with full weights. The equilibrium positions do not depend on how stiffness is shared, and weights would load
    // particles with forces that the finite elements balance. Particles in equilibrium in the old overlap are not in
    // equilibrium in the new one. The outermost particles lack bonds and are not mass_before. Damaged particles are not
    // mass_before either, because their contacts would treat the displacement as sliding.
    moving.insert(moving.end(), reweighted.begin(), reweighted.end());
    const std::vector<int> broken = broken_counts();
    const auto stays = [&](int i)
    {
      const auto partners = overlap.bonds().partners_of(i);
      return broken[i] > 0 ||
             !std::all_of(partners.begin(), partners.end(), [&](int partner) { return dem.is_active()[partner]; });
    };
    moving.erase(std::remove_if(moving.begin(), moving.end(), stays), moving.end());
  }
  dem.set_weights(tie == Tie::mean && !at_rest ? Eigen::VectorXd(Eigen::VectorXd::Ones(packing.size())) : overlap.de_weights());
  is_relaxing = !at_rest;
  forces.set_up();
  if (!at_rest)
  {
    relax(settings.bond, bond_material(settings, packing).density, relaxation_steps, packing, moving, accelerations, dem,
          forces.compute, forces.springs);
    is_relaxing = false;
    dem.set_weights(overlap.de_weights());
    forces.compute();
  }
}

/// Number of broken bonds of each particle, by index in the packing, the same on every rank.
std::vector<int> Conversion::broken_counts() const
{
  const dem::Particles particles = dem.particles();
  const std::vector<double> damage = dem.damage();
  std::vector<int> local;
  for (int i = 0; i < particles.n && i < static_cast<int>(damage.size()); ++i)
    if (damage[i] > 0.)
    {
      const int index = particles.index[i];
      local.push_back(index);
      local.push_back(static_cast<int>(std::lround(damage[i] * overlap.bonds().count(index))));
    }
  std::vector<int> counts(packing.size(), 0);
  const std::vector<int> all = gather_all(local, MPI_INT, comm);
  for (std::size_t k = 0; k < all.size(); k += 2)
    counts[all[k]] = all[k + 1];
  return counts;
}
} // namespace kerf
