// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/coupled_model.h"

#include <fstream>
#include <string>

namespace kerf
{
/// Writes activations.csv: one row for each conversion, with the conserved quantities before and after it.
class ConversionLog
{
public:
  /// @param plane two dimensions: components that are always zero are left out
  ConversionLog(const std::string &directory, bool plane);
  void add(const ActivationEvent &event);

private:
  bool plane;
  std::string path;
  std::ofstream csv;
};
} // namespace kerf
