// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/make_constraint.h"

#include "coupler/method/constraint/lumped_multiplier_constraint.h"
#include "coupler/method/constraint/penalty_constraint.h"
#include "coupler/method/constraint/weak_multiplier_constraint.h"

#include <algorithm>
#include <stdexcept>

namespace kerf
{
namespace
{
std::vector<ConstraintMethod> &methods()
{
  static std::vector<ConstraintMethod> list = {{"penalty", make_penalty, true},
                                               {"penalty_mass_scaled", make_mass_scaled_penalty, true},
                                               {"multipliers", make_weak_multipliers},
                                               {"multipliers_diagonal", make_lumped_multipliers}};
  return list;
}

std::vector<ConstraintMethod>::const_iterator find_method(const std::string &name)
{
  return std::find_if(methods().begin(), methods().end(), [&](const ConstraintMethod &method) { return method.name == name; });
}
} // namespace

const std::vector<ConstraintMethod> &constraint_methods()
{
  return methods();
}

void register_constraint_method(const ConstraintMethod &method)
{
  if (find_method(method.name) != methods().end())
    throw std::logic_error("a constraint method named " + method.name + " exists already");
  methods().push_back(method);
}

const ConstraintMethod &constraint_method(const std::string &name)
{
  const auto found = find_method(name);
  if (found == methods().end())
    throw std::logic_error("no constraint method is named " + name);
  return *found;
}

std::unique_ptr<Constraint> make_constraint(const ConstraintModel &model)
{
  return constraint_method(model.settings.method).make(model);
}
} // namespace kerf
