// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/energy/energy_ledger.h"

#include <algorithm>
#include <cmath>
#include <sstream>

namespace kerf
{
std::string EnergyLedger::fastest_growing(const EnergyLedger &before) const
{
  const std::vector<std::pair<const char *, double EnergyLedger::*>> parts = {
    {"kinetic", &EnergyLedger::kinetic},     {"elastic", &EnergyLedger::elastic},
    {"coupling", &EnergyLedger::coupling},   {"damping", &EnergyLedger::damping},
    {"friction", &EnergyLedger::friction},   {"released", &EnergyLedger::released},
    {"interface", &EnergyLedger::interface}, {"absorbed", &EnergyLedger::absorbed},
    {"left", &EnergyLedger::left},           {"boundary work", &EnergyLedger::boundary_work},
    {"tool work", &EnergyLedger::tool_work}, {"conversion", &EnergyLedger::conversion}};
  const auto change = [&](const auto &part) { return std::abs(this->*part.second - before.*part.second); };
  const auto most = std::max_element(parts.begin(), parts.end(),
                                     [&](const auto &a, const auto &b)
                                     {
                                       const double x = change(a), y = change(b);
                                       return std::isfinite(x) && (!std::isfinite(y) || x < y);
                                     });
  std::ostringstream text;
  text << most->first << " energy grew most, from " << before.*most->second << " to " << this->*most->second << " J";
  return text.str();
}
} // namespace kerf
