// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/application/output/console.h"
#include "coupler/application/output/specimen_gauge.h"
#include "coupler/method/coupled_model.h"
#include "coupler/method/stability/stable_step.h"

#include <memory>

namespace kerf
{
/// The initial-value problem of a run: the checked case, its mesh and solver, its packing with calibrated bonds, and the time
/// step.
struct Problem
{
  Case settings; ///< with k_n, k_t of the store
  std::unique_ptr<fem::FemSide> fem;
  dem::Packing packing;
  Specimen specimen;                      ///< between platens
  std::unique_ptr<Constraint> constraint; ///< for the CoupledModel; refers to the packing
  StableSteps stable;
  double dt = 0.;
};

/// What happens to a store that exists and is calibrated for another rock. Several cases may share a store.
enum class StoreUse
{
  kept,        ///< stays as it is, the new stiffnesses are for this run
  recalibrated ///< gets the new stiffnesses
};

/// Sets up the problem and checks all that can be checked before a run. Generates, calibrates and saves the store when it is
/// missing. A store that exists is not changed. Mode fem has no store. Throws InputError. Collective.
std::unique_ptr<Problem> set_up_problem(const Case &settings, Mode mode, Console &console, MPI_Comm comm);

/// The first half of it: the mesh with all checks that need no packing. Packing, constraint and steps are empty. Throws
/// InputError. Collective.
std::unique_ptr<Problem> set_up_mesh(const Case &settings, Mode mode, Console &console, MPI_Comm comm);

/// Reads or generates the packing of a case and calibrates its bond stiffnesses. Throws InputError. Collective.
void build_packing(const Case &settings, const fem::FemSide &fem, dem::Packing &packing, StoreUse use, Console &console,
                   MPI_Comm comm);

/// Makes the finite-element side of the case. Throws InputError for errors of the mesh. Collective.
std::unique_ptr<fem::FemSide> build_fem(const Case &settings, MPI_Comm comm);

/// Quality of a packing as text of several lines.
std::string packing_summary(const dem::Packing &packing);
} // namespace kerf
