// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/method/overlap/overlap.h"
#include "coupler/method/stability/coupled_operator.h"

#include <memory>

namespace kerf
{
/// Stable steps of both sides and of the coupled model [s].
struct StableSteps
{
  double fem = 0.;     ///< 2/omega_max of the finite elements
  double dem = 0.;     ///< of the pack, bonded or broken, with contact damping and the tool's spring
  double overlap = 0.; ///< of the weighted, constrained model in and around the overlap; 0: no overlap yet
  double elastic = 0.; ///< of the coupled model; Safety is a share of it
  double coupled = 0.; ///< largest step the run may use: less with local damping, which pushes back along with the springs
  Refusal refusal = Refusal::none; ///< why there is none
};

/// Limits for a mode: the smallest of the sides that take part and of the overlap. Mode fixed has its overlap from the start:
/// its operator is solved. The overlap of mode adaptive is not known beforehand; there a penalty or relaxation lowers the
/// sides' limit by a bound, omega^2 dt^2 + beta <= 4; with constant springs, which know no masses, an overlap in the middle of
/// the mesh is solved, too. The operator of the real overlap is watched after each activation (see StabilityMonitor). Leaves
/// the weights of @p fem at one. When no step is stable, the refusal says why. Collective.
StableSteps stable_steps(const Case &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                         Constraint &constraint, MPI_Comm comm);

/// Bonds and density of the particles, for the operator of their network.
dem::NetworkOperator::Material bond_material(const Case &settings, const dem::Packing &packing);

/// Shortest edge of all cells [m].
double smallest_edge(const fem::Mesh &mesh);

/// Density of the particles, rock density / solid fraction [kg/m^3].
double particle_density(const Case &settings, const dem::Packing &packing);

/// Largest angular frequency of the particles, whole or broken [rad/s]. Broken rock has the stiffness of a bond in each contact
/// that sticks, and where it is pressed together particles have contacts they had no bonds for. So the network of all pairs
/// within half a mean radius counts where it is stiffer than that of the bonds.
double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density);
} // namespace kerf
