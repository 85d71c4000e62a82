// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/application/case_file/case_file.h"
#include "coupler/application/output/console.h"
#include "coupler/method/coupled_model.h"
#include "coupler/method/stability/stable_step.h"

#include <memory>

namespace kerf
{
/// What a run starts from: a checked case, its mesh and solver, its store with calibrated bonds and the time step.
struct Problem
{
  Case settings; ///< with k_n, k_t from the store
  std::unique_ptr<fem::FemSide> fem;
  dem::Packing packing;
  std::unique_ptr<Constraint> constraint; ///< for the CoupledModel; refers to the packing
  StableSteps stable;
  double dt = 0.;
};

/// Builds the problem and validates everything that can be known before a run. Generates, calibrates and saves the store when
/// it is missing or made for another rock; mode fem has none. Collective. Throws InputError.
std::unique_ptr<Problem> set_up_problem(const Case &settings, Mode mode, Console &console, MPI_Comm comm);

/// Mesh and store only (kerf pack).
void build_packing(const Case &settings, const fem::FemSide &fem, dem::Packing &packing, Console &console, MPI_Comm comm);

/// Deal.II side of the case; errors of the mesh become InputErrors that name the case.
std::unique_ptr<fem::FemSide> build_fem(const Case &settings, MPI_Comm comm);

/// Quality of a packing, some lines for a person.
std::string packing_summary(const dem::Packing &packing);
} // namespace kerf
