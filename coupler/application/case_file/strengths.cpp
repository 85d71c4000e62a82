// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/case_file/strengths.h"

#include "coupler/base/errors.h"

#include <cmath>
#include <fstream>
#include <iomanip>
#include <map>
#include <sstream>

namespace kerf
{
namespace
{
/// Visits the numbers that say for which packings, rock and bonds strengths hold, with their keys in the case.
template <typename Kind, typename Visit>
void visit_kind(Kind &strengths, const Visit &visit)
{
  visit("Packing/Radius spread", strengths.packing.radius_spread);
  visit("Packing/Gap tolerance", strengths.packing.gap_tolerance);
  visit("Rock/Young modulus", strengths.young);
  visit("Rock/Poisson ratio", strengths.poisson);
  visit("Rock/Tensile strength", strengths.target_tensile);
  visit("Rock/Compressive strength", strengths.target_compressive);
  visit("Bond/Shear strength friction", strengths.bond.shear_friction);
  visit("Bond/Friction", strengths.bond.friction);
}

/// The same for what was found, with names in the file.
template <typename Found, typename Visit>
void visit_results(Found &strengths, const Visit &visit)
{
  const auto measured = [&](const std::string &name, auto &value)
  {
    visit(name, value.mean);
    visit(name + " scatter", value.scatter);
  };
  visit("mean diameter", strengths.packing.mean_diameter);
  visit("R_n", strengths.bond.R_n);
  visit("R_t", strengths.bond.R_t);
  visit("packings", strengths.n_packings);
  measured("direct tensile strength", strengths.tensile);
  measured("uniaxial compressive strength", strengths.compressive);
  measured("Brazilian strength", strengths.brazilian);
  measured("specimen Young modulus", strengths.specimen_young);
  measured("specimen Poisson ratio", strengths.specimen_poisson);
}

std::string kind_of(const Strengths &strengths)
{
  const dem::PackingSettings &packing = strengths.packing;
  return packing.kind + (packing.kind == "triangular" && packing.lattice.row_axis == 1 ? "_rows_y" : "") + ' ' +
         std::to_string(packing.dim) + 'd';
}
} // namespace

dem::BondParameters Strengths::bond_for(double mean_diameter) const
{
  dem::BondParameters result = bond;
  const double scale = std::pow(mean_diameter / packing.mean_diameter, packing.dim - 1);
  result.R_n *= scale;
  result.R_t *= scale;
  return result;
}

std::string strengths_file(const std::string &directory)
{
  return directory + "/strengths.txt";
}

void save_strengths(const Strengths &strengths, const std::string &directory)
{
  std::ofstream file(strengths_file(directory));
  file << "# Bond strengths of this kind of packing, for every seed and mean diameter, and what specimens of it measured.\n"
          "# Written by kerf calibrate, used with Bond/Strength = calibrated. SI units; a scatter is a standard deviation.\n"
       << "kind = " << kind_of(strengths) << '\n'
       << std::setprecision(6);
  const auto write = [&](const std::string &name, double value) { file << name << " = " << value << '\n'; };
  visit_kind(strengths, write);
  visit_results(strengths, write);
  file.close();
  if (!file)
    throw InputError(strengths_file(directory) + ": cannot be written");
}

Strengths load_strengths(const std::string &directory)
{
  const std::string path = strengths_file(directory);
  std::ifstream file(path);
  if (!file)
    throw InputError(directory + "/case.prm: Bond/Strength = calibrated, but " + path + " does not exist; run kerf calibrate " +
                     directory);
  std::map<std::string, std::string> entries;
  for (std::string line; std::getline(file, line);)
    if (const auto equal = line.find(" = "); line[0] != '#' && equal != std::string::npos)
      entries[line.substr(0, equal)] = line.substr(equal + 3);

  const auto fail = [&](const std::string &name)
  { throw InputError(path + ": has no value of '" + name + "'; run kerf calibrate " + directory); };
  Strengths strengths;
  const auto read = [&](const std::string &name, double &value)
  {
    std::istringstream text(entries[name]);
    if (!(text >> value) || !std::isfinite(value))
      fail(name);
  };
  std::istringstream kind(entries["kind"]);
  char d = 0;
  if (!(kind >> strengths.packing.kind >> strengths.packing.dim >> d) || d != 'd')
    fail("kind");
  if (const auto rows = strengths.packing.kind.find("_rows_y"); rows != std::string::npos)
  {
    strengths.packing.kind.resize(rows);
    strengths.packing.lattice.row_axis = 1;
  }
  visit_kind(strengths, read);
  visit_results(strengths, read);
  return strengths;
}

std::string difference(const Strengths &known, const Strengths &wanted)
{
  if (kind_of(known) != kind_of(wanted))
    return "a packing of kind " + kind_of(known) + ", the case has " + kind_of(wanted);
  std::map<std::string, double> values;
  visit_kind(known, [&](const std::string &name, double value) { values[name] = value; });
  std::ostringstream text;
  visit_kind(wanted,
             [&](const std::string &name, double value)
             {
               // The file has six digits.
               if (text.str().empty() && std::abs(values[name] - value) > 1e-5 * std::abs(value))
                 text << name << " = " << values[name] << ", the case has " << value;
             });
  return text.str();
}
} // namespace kerf
