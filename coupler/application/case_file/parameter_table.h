// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <deal.II/base/patterns.h>

#include <memory>
#include <string>
#include <vector>

namespace kerf
{
/// One entry of the case file. The table is the only place where keys, units and allowed values are written down: parser,
/// error messages, echo and reference come from it.
struct Parameter
{
  std::string section, key, default_value;
  std::shared_ptr<dealii::Patterns::PatternBase> pattern;
  std::string allowed; ///< the pattern in words
  std::string unit, meaning, source;
};

const std::vector<Parameter> &parameter_table();

/// A key, or a value of a key, that had another name in the version before. The old name is read with a notice.
struct Renamed
{
  std::string section, key; ///< as it was
  std::string value;        ///< as it was; empty: the key was renamed, all values are kept
  std::string now;          ///< the key or the value
};

const std::vector<Renamed> &renamed_parameters();
} // namespace kerf
