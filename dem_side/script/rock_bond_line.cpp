// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/script/rock_bond_line.h"

#include <cmath>
#include <cstdlib>
#include <limits>
#include <set>
#include <stdexcept>
#include <vector>

namespace kerf::dem
{
namespace
{
[[noreturn]] void fail(const std::string &what)
{
  throw std::invalid_argument("pair_style gran model kerf_rock_bond: " + what);
}

struct Key
{
  const char *name;
  double *value;
  double lower, upper; // allowed: lower <= value < upper, above lower when it must be positive
  bool positive;
};

std::string allowed_values(const Key &key)
{
  if (key.positive)
    return "a number > 0";
  return std::isinf(key.upper) ? "a number >= 0" : "a number in [0, 1)";
}
} // namespace

RockBondLine parse_rock_bond_line(int n_words, const char *const *words)
{
  constexpr double infinite = std::numeric_limits<double>::infinity();
  RockBondLine line;
  const std::vector<Key> keys = {{"k_n", &line.bond.k_n, 0., infinite, true},
                                 {"k_t", &line.bond.k_t, 0., infinite, false},
                                 {"R_n", &line.bond.R_n, 0., infinite, true},
                                 {"R_t", &line.bond.R_t, 0., infinite, true},
                                 {"shear_friction", &line.bond.shear_friction, 0., infinite, false},
                                 {"friction", &line.bond.friction, 0., infinite, false},
                                 {"damping", &line.bond.damping, 0., infinite, false},
                                 {"local_damping", &line.local_damping, 0., 1., false}};
  std::set<std::string> named;
  for (int w = 0; w < n_words; w += 2)
  {
    const std::string name = words[w];
    if (!named.insert(name).second)
      fail(name + " is given twice");
    if (w + 1 == n_words)
      fail("'" + name + "' has no value, give pairs of key and value");
    const std::string text = words[w + 1];
    if (name == "store")
    {
      line.store = text;
      continue;
    }
    const Key *key = nullptr;
    std::string names;
    for (const Key &candidate : keys)
    {
      names += std::string(candidate.name) + ", ";
      if (name == candidate.name)
        key = &candidate;
    }
    if (key == nullptr)
      fail("unknown key '" + name + "', allowed are " + names + "store");
    char *end = nullptr;
    const double value = std::strtod(text.c_str(), &end);
    if (end == text.c_str() || *end != '\0' || !(value >= key->lower && value < key->upper) || (key->positive && value == 0.))
      fail(name + " = '" + text + "' is not allowed, give " + allowed_values(*key));
    *key->value = value;
  }
  std::vector<std::string> needed = {"k_n", "k_t"};
  if (!line.store.empty())
    needed.insert(needed.end(), {"R_n", "R_t"});
  for (const std::string &name : needed)
    if (named.count(name) == 0)
      fail(name + " is missing" + (name[0] == 'R' ? ", a store with bonds needs their strength" : ""));
  return line;
}
} // namespace kerf::dem
