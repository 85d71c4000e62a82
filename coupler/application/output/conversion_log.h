// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/coupled_model.h"

#include <fstream>
#include <string>

namespace kerf
{
/// activations.csv: one row for every change of models, what the body held before and after it.
class ConversionLog
{
public:
  /// @param plane 2D: components that are zero are left out
  ConversionLog(const std::string &directory, bool plane);
  void add(const ActivationEvent &event);

private:
  bool plane;
  std::ofstream csv;
};
} // namespace kerf
