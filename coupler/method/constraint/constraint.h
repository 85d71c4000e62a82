// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <memory>

namespace kerf
{
class Corrector;
class Fluctuations;

/// Energies of what ties the sides, of this rank [J].
struct ConstraintEnergy
{
  double stored = 0.;     ///< in springs
  double dissipated = 0.; ///< taken from both sides since the start, springs apart
};

/// What a constraint leaves to the fluctuations of a random packing about the field of the finite elements.
enum class Tie
{
  spring, ///< each particle by a spring of its own: comes to rest between it and its bonds
  rigid,  ///< each particle follows its point
  mean    ///< averages around nodes follow, single particles are free
};

/// Ties the particles of the overlap to the displacement field of the finite elements:
/// chi_i = u_i - sum_a N_a(X_i) u_a = 0 (Labra et al., eq. (3)). A method decides which forces enforce it. Every method pushes
/// particles and nodes by opposite forces along the rows of N, which sum to one, and nodes get the couple back that a force not
/// along chi makes (see CoupleOnNodes), or all forces are the gradient of an energy that no rotation changes (see Corrector):
/// linear and angular momentum are kept.
class Constraint
{
public:
  virtual ~Constraint() = default;

  /// After every activation: the constrained particles of the whole model (same list on every rank).
  virtual void set_particles(const std::vector<TiedParticle> &particles) = 0;

  /// Moves new particles from the smooth field of the finite elements to where the constraint wants them. Collective.
  virtual void place(std::vector<dem::NewParticle> &, const fem::FemSide &) {}

  /// Adds the forces for the present positions, after all other forces of both sides. Collective.
  virtual void apply(dem::Phase phase, dem::Particles &particles, fem::FemSide &fem) = 0;

  virtual Tie tie() const = 0;
  /// Stiffness of the springs on this rank's particles, in their order at the last apply() [N/m]; empty: no springs.
  virtual Eigen::VectorXd springs() const { return {}; }
  virtual ConstraintEnergy energy() const = 0;
  /// Where the constraint ties to places with fluctuations; valid as long as the constraint.
  virtual Corrector *corrector_of(const fem::FemSide &) { return nullptr; }
  /// Number of constrained particles of the whole model.
  virtual int n_particles() const = 0;
};

/// The method of the case. @param dt time step [s]; packing is kept by reference. @param fluctuations if they are known: else a
/// corrector makes its own.
std::unique_ptr<Constraint> make_constraint(const Case &settings, const dem::Packing &packing, double dt, MPI_Comm comm,
                                            std::shared_ptr<const Fluctuations> fluctuations = nullptr);
} // namespace kerf
