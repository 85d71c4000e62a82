// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <deal.II/base/patterns.h>

#include <memory>
#include <string>
#include <vector>

namespace kerf
{
/// One entry of the case file. The table is the only definition of keys, units and allowed values. Parser, error messages, echo
/// and reference use it.
struct Parameter
{
  std::string section, key, default_value;
  std::shared_ptr<dealii::Patterns::PatternBase> pattern;
  std::string allowed; ///< description of the pattern
  std::string unit, meaning, source;
};

const std::vector<Parameter> &parameter_table();

/// A key, or a value of a key, that was renamed since the previous version. The old name is accepted with a notice.
struct Renamed
{
  std::string section, key; ///< old names
  std::string value;        ///< old value; empty: the key was renamed and its values are kept
  std::string now;          ///< new name of the key or the value
};

const std::vector<Renamed> &renamed_parameters();
} // namespace kerf
