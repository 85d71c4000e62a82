// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace kerf
{
/// What a constraint is made from.
struct ConstraintModel
{
  ConstraintSettings settings;
  OverlapSettings overlap;
  double k_n = 0., k_t = 0.;             ///< of the bonds [N/m], 2D per metre
  double mean_diameter = 0.;             ///< d of the particles [m]
  const dem::Packing *packing = nullptr; ///< outlives the constraint
  MPI_Comm comm = MPI_COMM_WORLD;
};

/// A value of Coupling/Method.
struct ConstraintMethod
{
  std::string name;
  std::function<std::unique_ptr<Constraint>(const ConstraintModel &)> make;
  bool can_correct = false; ///< takes Coupling/Corrector
};

/// All methods; those of kerf are listed in make_constraint.cpp.
const std::vector<ConstraintMethod> &constraint_methods();
/// Adds a method before a case is read. Throws std::logic_error when the name is taken.
void register_constraint_method(const ConstraintMethod &method);
/// Throws std::logic_error when there is none of this name.
const ConstraintMethod &constraint_method(const std::string &name);

/// The constraint of the method that the settings name. set_time_step() is to follow.
std::unique_ptr<Constraint> make_constraint(const ConstraintModel &model);
} // namespace kerf
