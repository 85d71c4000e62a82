// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/constraint.h"
#include "coupler/method/constraint/constraint_model.h"

#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace kerf
{
/// A value of Coupling/Method.
struct ConstraintMethod
{
  std::string name;
  std::function<std::unique_ptr<Constraint>(const ConstraintModel &)> make;
  bool can_correct = false; ///< allows Coupling/Corrector
};

/// All methods. The built-in ones are listed in make_constraint.cpp.
const std::vector<ConstraintMethod> &constraint_methods();
/// Adds a method. To be called before a case is read. Throws std::logic_error when the name exists.
void register_constraint_method(const ConstraintMethod &method);
/// The method of this name. Throws std::logic_error when there is none.
const ConstraintMethod &constraint_method(const std::string &name);

/// Makes the constraint that the settings name. The caller must call set_time_step() next. Throws std::logic_error when the
/// name is unknown.
std::unique_ptr<Constraint> make_constraint(const ConstraintModel &model);
} // namespace kerf
