// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/case_file/case_file.h"

#include "coupler/application/case_file/parameter_table.h"
#include "coupler/base/errors.h"
#include "coupler/loading/surface_resolution.h"
#include "coupler/method/constraint/make_constraint.h"

#include <deal.II/base/parameter_handler.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <limits>
#include <optional>
#include <set>
#include <sstream>

namespace kerf
{
namespace
{
std::string trimmed(const std::string &text)
{
  const auto first = text.find_first_not_of(" \t\r\n");
  if (first == std::string::npos)
    return "";
  return text.substr(first, text.find_last_not_of(" \t\r\n") - first + 1);
}

std::vector<std::string> split(const std::string &text, char separator)
{
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, separator);)
    if (!trimmed(part).empty())
      parts.push_back(trimmed(part));
  return parts;
}

/// Number of edits (insert, delete, replace) between two words, for "did you mean".
std::size_t edit_distance(const std::string &a, const std::string &b)
{
  std::vector<std::size_t> row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j)
    row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i)
  {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j)
    {
      const std::size_t above = row[j];
      row[j] = std::min({above + 1, row[j - 1] + 1, diagonal + (a[i - 1] != b[j - 1])});
      diagonal = above;
    }
  }
  return row[b.size()];
}

/// The finite number that the whole of @p text is. Numbers too small to have all digits are zero: one cannot divide by them.
std::optional<double> finite_number(const std::string &text)
{
  if (text.empty() || text.find_first_not_of("0123456789+-.eE") != std::string::npos)
    return std::nullopt; // no inf, no nan, no hexadecimal numbers
  char *end = nullptr;
  const double value = std::strtod(text.c_str(), &end);
  if (end != text.c_str() + text.size() || !std::isfinite(value))
    return std::nullopt;
  return std::abs(value) < std::numeric_limits<double>::min() ? 0. : value;
}

/// Throws InputError unless @p path is a file that ends, which no device and no pipe does. @param where for the message
void check_is_file(const std::string &where, const std::string &path)
{
  if (!std::filesystem::exists(path))
    throw InputError(where + shown(path) + " does not exist");
  if (!std::filesystem::is_regular_file(path))
    throw InputError(where + shown(path) + " is no file, but a directory, a device or a pipe");
}

/// The valid key that the user may have meant: of the same section, if the section exists.
const Parameter &nearest_key(const std::string &section, const std::string &key)
{
  const auto &table = parameter_table();
  const bool known =
    std::any_of(table.begin(), table.end(), [&](const Parameter &parameter) { return parameter.section == section; });
  const Parameter *nearest = nullptr;
  std::size_t least = 0;
  for (const Parameter &parameter : table)
  {
    if (known && parameter.section != section)
      continue;
    const std::size_t distance =
      known ? edit_distance(parameter.key, key) : edit_distance(parameter.section + "/" + parameter.key, section + "/" + key);
    if (nearest == nullptr || distance < least)
    {
      nearest = &parameter;
      least = distance;
    }
  }
  return *nearest;
}

/// Checks an assignment against the table and returns the entry. Throws InputError.
const Parameter &checked_entry(const std::string &where, const std::string &section, const std::string &key,
                               const std::string &value)
{
  for (const Parameter &parameter : parameter_table())
    if (parameter.section == section && parameter.key == key)
    {
      if (!parameter.pattern->match(value))
        throw InputError(where + ": " + section + "/" + key + " = '" + shown(value) + "' is not allowed: give " +
                         parameter.allowed + " [" + parameter.unit + "]");
      return parameter;
    }
  const std::string cut_section = shown(section), cut_key = shown(key); // the search takes time that grows with the length
  const Parameter &nearest = nearest_key(cut_section, cut_key);
  throw InputError(where + ": unknown key " + cut_section + "/" + cut_key + ", the nearest valid key is " + nearest.section +
                   "/" + nearest.key + " (all keys: kerf params)");
}

/// Replaces a name of the previous version by the present one and adds a notice.
void use_present_names(const std::string &where, const std::string &section, std::string &key, std::string &value,
                       std::vector<std::string> &notices)
{
  for (const Renamed &renamed : renamed_parameters())
  {
    if (renamed.section != section || renamed.key != key || (!renamed.value.empty() && renamed.value != value))
      continue;
    const std::string name = section + "/" + key;
    if (renamed.value.empty())
    {
      notices.push_back("notice: " + where + ": " + name + " is named " + section + "/" + renamed.now + " now");
      key = renamed.now;
    }
    else
    {
      notices.push_back("notice: " + where + ": " + name + " = " + value + " is named " + renamed.now + " now");
      value = renamed.now;
    }
  }
}

/// The text of the file with the present names. The file is checked here first, because ParameterHandler reports errors in
/// several lines. Throws InputError.
std::string checked_text(const std::string &path, std::vector<std::string> &notices)
{
  std::ostringstream result;
  std::set<std::string> given;
  std::ifstream file(path);
  if (!file)
    throw InputError(path + ": no such file, a case directory holds a case.prm");
  std::vector<std::string> sections;
  int number = 0;
  for (std::string line; std::getline(file, line);)
  {
    const std::string where = path + ":" + std::to_string(++number);
    if (number == 1 && line.rfind("\xEF\xBB\xBF", 0) == 0)
      line.erase(0, 3); // the byte order mark of some editors
    const std::string text = trimmed(line.substr(0, line.find('#')));
    if (text.empty())
      continue;
    if (text.rfind("subsection ", 0) == 0)
    {
      sections.push_back(trimmed(text.substr(11)));
      if (sections.size() > 1)
        throw InputError(where + ": 'subsection " + shown(sections[1]) + "' stands in another one, end '" + shown(sections[0]) +
                         "' before");
    }
    else if (text == "end")
    {
      if (sections.empty())
        throw InputError(where + ": 'end' without 'subsection'");
      // A section without keys would reach ParameterHandler unchecked.
      if (const auto &table = parameter_table(); std::none_of(
            table.begin(), table.end(), [&](const Parameter &parameter) { return parameter.section == sections.back(); }))
        throw InputError(where + ": unknown section " + shown(sections.back()) + ", the nearest valid key is " +
                         nearest_key(shown(sections.back()), "").section + "/... (all keys: kerf params)");
      sections.pop_back();
    }
    else if (text.rfind("set ", 0) == 0 && text.find('=') != std::string::npos)
    {
      const auto equal = text.find('=');
      const std::string section = sections.size() == 1 ? sections[0] : "";
      std::string key = trimmed(text.substr(4, equal - 4)), value = trimmed(text.substr(equal + 1));
      use_present_names(where, section, key, value, notices);
      checked_entry(where, section, key, value);
      if (!given.insert(section + "/" + key).second)
        throw InputError(where + ": " + section + "/" + key + " is given twice, give it once");
      result << "set " << key << " = " << value << '\n';
      continue;
    }
    else
      throw InputError(where + ": '" + shown(text) +
                       "' is not understood, lines are 'subsection NAME', 'set KEY = VALUE', 'end'");
    result << text << '\n';
  }
  if (!sections.empty())
    throw InputError(path + ": 'subsection " + shown(sections.back()) + "' has no 'end'");
  return result.str();
}

/// Reads file and overrides into the handler. Returns notices on old names.
std::vector<std::string> read_handler(dealii::ParameterHandler &handler, const std::string &directory,
                                      const std::vector<Override> &overrides)
{
  std::vector<std::string> notices;
  for (const Parameter &parameter : parameter_table())
  {
    handler.enter_subsection(parameter.section);
    handler.declare_entry(parameter.key, parameter.default_value, *parameter.pattern,
                          parameter.meaning + " [" + parameter.unit + "]");
    handler.leave_subsection();
  }
  if (!std::filesystem::is_directory(directory))
    throw InputError(directory + ": no such case directory");
  const std::string path = directory + "/case.prm";
  if (std::filesystem::exists(path))
    check_is_file("", path);
  handler.parse_input_from_string(checked_text(path, notices));
  for (const Override &override : overrides)
  {
    const auto slash = override.find('/'), equal = override.find('=');
    if (slash == std::string::npos || equal == std::string::npos || equal < slash)
      throw InputError("--set " + shown(override) + ": give Section/Key=value");
    const std::string section = trimmed(override.substr(0, slash));
    std::string key = trimmed(override.substr(slash + 1, equal - slash - 1)), value = trimmed(override.substr(equal + 1));
    use_present_names("--set", section, key, value, notices);
    checked_entry("--set", section, key, value);
    handler.enter_subsection(section);
    handler.set(key, value);
    handler.leave_subsection();
  }
  return notices;
}

/// Typed access to parameters. Its errors name file, section and key.
class Reader
{
public:
  Reader(dealii::ParameterHandler &handler, std::string file) : handler(handler), file(std::move(file)) {}

  double number(const std::string &section, const std::string &key) const { return parsed(section, key, text(section, key)); }
  int integer(const std::string &section, const std::string &key) const
  {
    return static_cast<int>(number(section, key)); // in range by its pattern
  }
  bool flag(const std::string &section, const std::string &key) const
  {
    const std::string value = text(section, key);
    return value == "true" || value == "yes";
  }
  std::string text(const std::string &section, const std::string &key) const
  {
    handler.enter_subsection(section);
    const std::string value = trimmed(handler.get(key));
    handler.leave_subsection();
    return value;
  }
  Eigen::Vector3d point(const std::string &section, const std::string &key) const
  {
    Eigen::Vector3d result = Eigen::Vector3d::Zero();
    const auto parts = split(text(section, key), ',');
    for (std::size_t i = 0; i < parts.size() && i < 3; ++i)
      result[i] = parsed(section, key, parts[i]);
    return result;
  }
  /// Items separated by ';', each with @p columns numbers separated by blanks.
  std::vector<std::vector<double>> rows(const std::string &section, const std::string &key, std::size_t columns) const
  {
    std::vector<std::vector<double>> result;
    for (const std::string &item : split(text(section, key), ';'))
    {
      std::istringstream stream(item);
      std::vector<double> row;
      bool all_numbers = true;
      for (std::string word; stream >> word;)
      {
        const std::optional<double> value = finite_number(word);
        all_numbers = all_numbers && value;
        row.push_back(value.value_or(0.));
      }
      if (row.size() != columns || !all_numbers)
        fail(section, key, "'" + shown(item) + "' is not " + std::to_string(columns) + " numbers separated by blanks");
      result.push_back(row);
    }
    return result;
  }
  void set(const std::string &section, const std::string &key, const std::string &value) const
  {
    handler.enter_subsection(section);
    handler.set(key, value);
    handler.leave_subsection();
  }
  void set(const std::string &section, const std::string &key, double value) const
  {
    std::ostringstream text;
    text << std::setprecision(10) << value;
    set(section, key, text.str());
  }
  [[noreturn]] void fail(const std::string &section, const std::string &key, const std::string &what) const
  {
    throw InputError(file + ": " + section + "/" + key + ": " + what);
  }

private:
  double parsed(const std::string &section, const std::string &key, const std::string &word) const
  {
    const std::optional<double> value = finite_number(word);
    if (!value)
      fail(section, key, "'" + shown(word) + "' is not a finite number");
    return *value;
  }

  dealii::ParameterHandler &handler;
  std::string file;
};

/// muParser takes a single '=' for an assignment, which is always true where the value is not zero.
bool assigns(const std::string &expression)
{
  for (std::size_t k = expression.find('='); k != std::string::npos; k = expression.find('=', k + 1))
  {
    const bool after = k > 0 && std::string("<>=!").find(expression[k - 1]) != std::string::npos;
    const bool before = k + 1 < expression.size() && expression[k + 1] == '=';
    if (!after && !before)
      return true;
  }
  return false;
}

/// @param box whether the mesh is a structured box, whose sides have names
fem::BoundaryCondition boundary_condition(const Reader &reader, const std::string &item, int dim, bool box)
{
  const auto fail = [&](const std::string &what) { reader.fail("Boundary", "Conditions", "'" + shown(item) + "': " + what); };
  fem::BoundaryCondition condition;
  const auto colon = item.find(':');
  if (colon == std::string::npos)
    fail("give 'id: kind'");
  const std::string id = trimmed(item.substr(0, colon));
  const std::vector<std::string> sides = {"left", "right", "bottom", "top", "back", "front"};
  const auto side = std::find(sides.begin(), sides.end(), id);
  if (side != sides.end() && !box)
    fail("only a box has sides with names, give the number of a boundary of the mesh or an expression such as y < 1e-6");
  if (assigns(id))
    fail("'=' alone is an assignment, give an inequality such as y < 1e-6, or ==");
  if (side != sides.end())
    condition.id = static_cast<int>(side - sides.begin());
  else if (!id.empty() && std::all_of(id.begin(), id.end(), ::isdigit))
  {
    if (id.size() > 9)
      fail("'" + shown(id) + "' is no number of a boundary, those have at most nine digits");
    condition.id = std::stoi(id);
  }
  else if (id.find_first_of("<>=&|") != std::string::npos)
    condition.where = id;
  else
    fail("'" + shown(id) +
         "' is no boundary, give a number, left, right, bottom, top, back, front or an expression such as y < 1e-6");

  std::istringstream stream(item.substr(colon + 1));
  std::string kind;
  stream >> kind;
  if (kind == "free")
    condition.kind = fem::BoundaryKind::free;
  else if (kind == "fixed")
    condition.kind = fem::BoundaryKind::fixed;
  else if (kind == "roller")
    condition.kind = fem::BoundaryKind::roller;
  else if (kind == "absorbing")
    condition.kind = fem::BoundaryKind::absorbing;
  else if (kind == "in_situ")
    condition.kind = fem::BoundaryKind::in_situ;
  else if (kind == "velocity" || kind == "traction")
  {
    const bool moves = kind == "velocity";
    condition.kind = moves ? fem::BoundaryKind::velocity : fem::BoundaryKind::traction;
    std::string word;
    const std::string x = moves ? "V" : "T";
    const std::string form =
      "give '" + kind + ' ' + x + "X " + x + (dim == 2 ? "Y" : "Y " + x + "Z") + " ramp " + (moves ? "T'" : "DURATION'");
    const auto next_number = [&]
    {
      std::string next;
      stream >> next;
      const std::optional<double> value = finite_number(next);
      if (!value)
        fail(form);
      return *value;
    };
    for (int c = 0; c < dim; ++c)
      (moves ? condition.velocity : condition.traction)[c] = next_number();
    if (stream >> word)
    {
      if (word != "ramp")
        fail(form);
      condition.ramp = next_number();
      if (condition.ramp < 0.)
        fail(form);
    }
  }
  else
    fail("'" + shown(kind) +
         "' is not a kind of condition, give free, fixed, roller, velocity, traction, in_situ or absorbing");
  std::string rest;
  if (stream >> rest)
    fail("'" + shown(rest) + "' is not understood");
  return condition;
}

Eigen::Matrix3d initial_stress(const Reader &reader, int dim)
{
  Eigen::Matrix3d stress = Eigen::Matrix3d::Zero();
  const auto rows = reader.rows("Loads", "Initial stress", dim == 2 ? 3 : 6);
  if (rows.size() > 1)
    reader.fail("Loads", "Initial stress", "must be one stress, without ';'");
  if (!rows.empty() && dim == 2)
    stress.topLeftCorner<2, 2>() << rows[0][0], rows[0][2], rows[0][2], rows[0][1];
  else if (!rows.empty())
    stress << rows[0][0], rows[0][5], rows[0][4], rows[0][5], rows[0][1], rows[0][3], rows[0][4], rows[0][3], rows[0][2];
  return stress;
}

template <typename Choice>
Choice choose(const std::string &text, const std::vector<std::pair<std::string, Choice>> &choices)
{
  for (const auto &choice : choices)
    if (choice.first == text)
      return choice.second;
  throw InputError("'" + text + "' is not a known choice");
}

ToolSettings read_tool(const Reader &reader)
{
  ToolSettings tool;
  tool.kind = choose<ToolKind>(reader.text("Tool", "Kind"),
                               {{"none", ToolKind::none}, {"disc", ToolKind::disc}, {"platens", ToolKind::platens}});
  tool.radius = reader.number("Tool", "Radius");
  tool.width = reader.number("Tool", "Width");
  if (tool.width > 0. && reader.integer("Mesh", "Dimension") == 2)
    reader.fail("Tool", "Width", "applies in three dimensions only; in two the disc is an infinite cylinder, give 0");
  if (tool.width > 2. * tool.radius)
    reader.fail("Tool", "Width", "must not be larger than twice the radius");
  for (const auto &row : reader.rows("Tool", "Path", 3))
  {
    if (!tool.path.empty() && row[0] <= tool.path.back().first)
      reader.fail("Tool", "Path", "times must increase");
    tool.path.push_back({row[0], Eigen::Vector3d(row[1], row[2], reader.number("Tool", "Middle"))});
  }
  if (tool.kind == ToolKind::disc && tool.path.empty())
    reader.fail("Tool", "Path", "a disc needs at least one way point 't x y'");
  tool.smoothing_time = reader.number("Tool", "Smoothing time");
  tool.rolling = reader.flag("Tool", "Rolling");
  tool.closing_speed = reader.number("Tool", "Closing speed");
  if (tool.closing_speed == 0.)
    reader.fail("Tool", "Closing speed", "must not be 0, give a speed > 0 to press or < 0 to pull");
  tool.stiffness_ratio = reader.number("Tool", "Stiffness ratio");
  tool.friction = reader.number("Tool", "Friction");
  tool.damping = reader.number("Tool", "Damping ratio");
  // The tangential force of a contact is that of its dashpot up to Coulomb's limit. Platens that pull let the rock slide
  // freely.
  if (tool.present() && !tool.pulls() && tool.friction > 0. && tool.damping == 0.)
    reader.fail("Tool", "Damping ratio",
                "must be > 0 with Tool/Friction > 0, because friction acts through the dashpot and would "
                "vanish; give 0.1, or Tool/Friction = 0");
  return tool;
}

/// Puts calibrated strengths into the case, sets sigma* and words the source of both.
void set_strengths(Case &settings, const Reader &reader)
{
  ActivationSettings &activation = settings.activation;
  std::ostringstream text;
  text << std::setprecision(4) << "bond strengths   ";
  const auto name_bonds = [&]
  { text << "R_n = " << settings.bond.R_n << ", R_t = " << settings.bond.R_t << (settings.dim() == 2 ? " N/m" : " N"); };
  const bool calibrated = reader.text("Bond", "Strength") == "calibrated";
  if (calibrated)
  {
    const Strengths known = load_strengths(settings.directory);
    if (const std::string other = difference(known, strengths_wanted(settings)); !other.empty())
      throw InputError(settings.directory + "/case.prm: Bond/Strength = calibrated, but " + strengths_file(settings.directory) +
                       " holds for " + other + "; run kerf calibrate " + settings.directory);
    const dem::BondParameters bond = known.bond_for(settings.packing.mean_diameter);
    settings.bond.R_n = bond.R_n;
    settings.bond.R_t = bond.R_t;
    activation.tensile_strength = known.tensile.mean;
    activation.compressive_strength = known.compressive.mean;
    const auto measured = [&](const char *name, const Measured &value)
    { text << name << value.mean / 1e6 << " +- " << value.scatter / 1e6 << " MPa"; };
    name_bonds();
    text << ", calibrated; specimens: ";
    measured("direct tension ", known.tensile);
    measured(", uniaxial compression ", known.compressive);
    measured(", Brazilian ", known.brazilian);
  }
  else
  {
    name_bonds();
    text << ", as given";
  }

  activation.sigma_star = reader.number("Adaptivity", "Sigma star");
  const bool given = activation.sigma_star > 0.;
  const double fraction = reader.number("Adaptivity", "Sigma star fraction");
  if (!given)
    activation.sigma_star = fraction * activation.tensile_strength;
  text << "\nsigma*           " << activation.sigma_star / 1e6 << " MPa";
  if (given)
    text << ", as given";
  else if (calibrated)
    text << " = " << fraction << " x direct tensile strength of the specimens";
  else
    text << " = " << fraction << " x Rock/Tensile strength; notice: the strength of the bonds as given is not known, kerf "
         << "calibrate measures it";
  settings.strength_summary = text.str();
}

} // namespace

Mode mode_from_name(const std::string &name)
{
  return choose<Mode>(name, {{"adaptive", Mode::adaptive}, {"fixed", Mode::fixed}, {"dem", Mode::dem}, {"fem", Mode::fem}});
}

std::string name_of(Mode mode)
{
  switch (mode)
  {
  case Mode::adaptive:
    return "adaptive";
  case Mode::fixed:
    return "fixed";
  case Mode::dem:
    return "dem";
  default:
    return "fem";
  }
}

Strengths strengths_wanted(const Case &settings)
{
  Strengths wanted;
  wanted.packing = settings.packing;
  wanted.young = settings.body.material.young;
  wanted.poisson = settings.body.material.poisson;
  wanted.target_tensile = settings.activation.tensile_strength;
  wanted.target_compressive = settings.activation.compressive_strength;
  wanted.bond = settings.bond;
  return wanted;
}

ToolSettings read_tool_of_case(const std::string &directory)
{
  dealii::ParameterHandler handler;
  read_handler(handler, directory, {});
  return read_tool(Reader(handler, directory + "/case.prm"));
}

Case read_case(const std::string &directory, const std::vector<Override> &overrides)
{
  dealii::ParameterHandler handler;
  Case result;
  result.notices = read_handler(handler, directory, overrides);
  const Reader reader(handler, directory + "/case.prm");
  result.directory = directory;
  result.name = std::filesystem::weakly_canonical(directory).filename().string();
  const auto in_case = [&](const std::string &path)
  { return std::filesystem::path(path).is_absolute() ? path : directory + "/" + path; };

  result.mode = mode_from_name(reader.text("Run", "Mode"));

  result.body.material.density = reader.number("Rock", "Density");
  result.body.material.young = reader.number("Rock", "Young modulus");
  result.body.material.poisson = reader.number("Rock", "Poisson ratio");
  result.activation.tensile_strength = reader.number("Rock", "Tensile strength");
  result.activation.compressive_strength = reader.number("Rock", "Compressive strength");

  const int dim = reader.integer("Mesh", "Dimension");
  result.packing.dim = result.body.dim = dim;
  const std::string mesh_file = reader.text("Mesh", "File");
  result.body.mesh.gmsh_file = mesh_file.empty() ? "" : in_case(mesh_file);
  if (!mesh_file.empty())
    check_is_file(directory + "/case.prm: Mesh/File: ", result.body.mesh.gmsh_file);
  result.body.mesh.shape =
    choose<fem::MeshShape>(reader.text("Mesh", "Shape"), {{"box", fem::MeshShape::box}, {"disc", fem::MeshShape::disc}});
  result.body.mesh.flat_angle = reader.number("Mesh", "Flat angle") * M_PI / 180.;
  result.body.mesh.lower = reader.point("Mesh", "Lower corner");
  result.body.mesh.upper = reader.point("Mesh", "Upper corner");
  result.body.mesh.cell_size = reader.number("Mesh", "Cell size");
  result.body.mesh.fine_lower = reader.point("Mesh", "Fine zone lower corner");
  result.body.mesh.fine_upper = reader.point("Mesh", "Fine zone upper corner");
  result.body.mesh.growth = reader.number("Mesh", "Growth ratio");
  result.body.mesh.largest_cell_size = reader.number("Mesh", "Largest cell size");
  for (const char axis : reader.text("Mesh", "Periodic"))
    if (const int c = axis - 'x'; c == 1 || c == 2) // no character of "none" is an axis
    {
      if (c >= dim)
        reader.fail("Mesh", "Periodic", "in two dimensions none or y are allowed");
      result.body.mesh.periodic[c] = result.packing.periodic[c] = true;
    }
  for (const auto &row : reader.rows("Mesh", "Refine", 2 * dim + 1))
  {
    fem::RefinedBox box;
    for (int c = 0; c < dim; ++c)
      box.lower[c] = row[c], box.upper[c] = row[dim + c];
    box.levels = static_cast<int>(row[2 * dim]);
    if (box.levels != row[2 * dim] || box.levels < 1 || box.levels > 8)
      reader.fail("Mesh", "Refine", "the number of halvings must be a whole number, 1 to 8");
    result.body.mesh.refined.push_back(box);
  }
  bool extended = true;
  for (int c = 0; c < dim; ++c)
    extended = extended && result.body.mesh.upper[c] > result.body.mesh.lower[c];
  if (mesh_file.empty() && !extended)
    reader.fail("Mesh", "Upper corner",
                std::string("must be larger than the lower corner in ") + (dim == 2 ? "x and y" : "x, y and z"));

  result.body.strain = choose<fem::Strain>(reader.text("Finite elements", "Strain"),
                                           {{"finite", fem::Strain::finite}, {"small", fem::Strain::small}});
  result.body.integration = choose<fem::Integration>(
    reader.text("Finite elements", "Integration"),
    {{"full", fem::Integration::full}, {"selective", fem::Integration::selective}, {"one_point", fem::Integration::one_point}});

  const bool box = result.body.mesh.gmsh_file.empty() && result.body.mesh.shape == fem::MeshShape::box;
  for (const std::string &item : split(reader.text("Boundary", "Conditions"), ';'))
    result.body.boundary_conditions.push_back(boundary_condition(reader, item, dim, box));
  result.body.gravity = reader.point("Loads", "Gravity");
  result.body.gravity_ramp = reader.number("Loads", "Gravity ramp");
  result.body.initial_stress = initial_stress(reader, dim);

  result.packing.kind = reader.text("Packing", "Kind");
  result.packing.mean_diameter = result.mean_diameter = reader.number("Packing", "Mean diameter");
  result.body.surface_spacing = surface_resolution::point_spacing * result.mean_diameter;
  result.packing.radius_spread = reader.number("Packing", "Radius spread");
  result.packing.gap_tolerance = reader.number("Packing", "Gap tolerance");
  result.packing.seed = static_cast<unsigned>(reader.integer("Packing", "Seed"));
  result.packing.lattice.row_axis = reader.text("Packing", "Lattice rows") == "y" ? 1 : 0;
  if (const std::string plane = reader.text("Packing", "Lattice plane"); !plane.empty())
  {
    const std::optional<double> at = finite_number(plane);
    if (!at)
      reader.fail("Packing", "Lattice plane", "'" + shown(plane) + "' is not a number, give x in m or leave it empty");
    result.packing.lattice.plane_at = *at;
  }
  std::string packing_file = reader.text("Packing", "File");
  if (packing_file.empty())
    packing_file = "packing_" + result.packing.kind + "_" + std::to_string(std::lround(1e6 * result.packing.mean_diameter)) +
                   "um_seed" + std::to_string(result.packing.seed) + ".h5";
  result.packing_file = in_case(packing_file);
  if (std::filesystem::exists(result.packing_file))
    check_is_file(directory + "/case.prm: Packing/File: ", result.packing_file);
  const std::string surface_file = reader.text("Packing", "Surface");
  result.packing_surface_file = surface_file.empty() ? "" : in_case(surface_file);
  if (!surface_file.empty())
    check_is_file(directory + "/case.prm: Packing/Surface: ", result.packing_surface_file);

  result.bond.R_n = reader.number("Bond", "Tensile strength");
  result.bond.R_t = reader.number("Bond", "Shear strength");
  result.bond.shear_friction = reader.number("Bond", "Shear strength friction");
  result.bond.friction = reader.number("Bond", "Friction");
  result.bond.damping = reader.number("Bond", "Damping ratio");
  result.calibration.n_packings = reader.integer("Calibration", "Packings");
  const double width = reader.number("Calibration", "Specimen width");
  result.calibration.specimen_width = (width > 0. ? width : dim == 2 ? 40. : 16.) * result.packing.mean_diameter;
  result.calibration.transits = reader.number("Calibration", "Transits");
  result.local_damping = reader.number("Bond", "Local damping");

  result.constraint.method = reader.text("Coupling", "Method");
  result.overlap_cells = reader.number("Coupling", "Overlap cells");
  result.overlap.width = result.overlap_cells > 0. ? result.overlap_cells * result.body.mesh.cell_size
                                                   : reader.number("Coupling", "Overlap width") * result.packing.mean_diameter;
  result.constraint.interface_damping = reader.number("Coupling", "Interface damping");
  result.bond.breaking_weight = reader.number("Coupling", "Breaking weight");
  result.constraint.fluctuation_relaxation = reader.number("Coupling", "Fluctuation relaxation");
  result.overlap.weight_function = choose<WeightFunction>(
    reader.text("Coupling", "Weight function"),
    {{"linear", WeightFunction::linear}, {"cubic", WeightFunction::cubic}, {"constant", WeightFunction::constant}});
  result.constraint.penalty_ratio = reader.number("Coupling", "Penalty ratio");
  result.constraint.corrector = reader.text("Coupling", "Corrector") == "weak";
  if (result.constraint.corrector && !constraint_method(result.constraint.method).can_correct)
    reader.fail("Coupling", "Corrector", "is for the methods penalty and penalty_mass_scaled, multipliers need none");
  if (result.constraint.corrector && result.constraint.interface_damping > 0.)
    reader.fail("Coupling", "Corrector", "cannot be combined with interface damping, set Coupling/Interface damping = 0");

  result.activation.criterion =
    choose<Criterion>(reader.text("Adaptivity", "Criterion"), {{"maximum_principal", Criterion::maximum_principal},
                                                               {"von_mises", Criterion::von_mises},
                                                               {"mohr_coulomb", Criterion::mohr_coulomb},
                                                               {"drucker_prager", Criterion::drucker_prager}});
  result.activation.by_contact = reader.flag("Adaptivity", "Contact activation");
  result.activation.check_interval = reader.integer("Adaptivity", "Check interval");
  result.activation.relaxation_steps = reader.integer("Adaptivity", "Relaxation steps");
  result.activation.event_fraction = reader.number("Adaptivity", "Event fraction");
  result.activation.return_fraction = reader.number("Adaptivity", "Return fraction");
  result.activation.return_time = reader.number("Adaptivity", "Return time");
  for (const auto &row : reader.rows("Fixed", "Region", 2 * dim))
  {
    Box box{Eigen::Vector3d(0., 0., -1.), Eigen::Vector3d(0., 0., 1.)};
    for (int c = 0; c < dim; ++c)
      box.lower[c] = row[c], box.upper[c] = row[dim + c];
    result.fixed_region.push_back(box);
  }

  result.tool = read_tool(reader);
  result.energy_tolerance = reader.number("Time", "Energy tolerance");
  result.end_time = reader.number("Time", "End time");
  result.stop_below = reader.number("Time", "Stop below");
  result.time_step = reader.number("Time", "Time step");
  result.safety = reader.number("Time", "Safety");
  result.history_interval = reader.integer("Output", "History interval");
  if (result.stop_below > 0. && result.tool.kind != ToolKind::platens)
    reader.fail("Time", "Stop below", "is for the platens of a press, give 0 with another Tool/Kind");
  if (result.activation.compressive_strength < result.activation.tensile_strength)
    reader.fail("Rock", "Compressive strength", "is below Rock/Tensile strength, give a rock's: five to twenty times as much");
  result.n_snapshots = reader.integer("Output", "Snapshots");
  set_strengths(result, reader);

  // The case as it is used: strengths and sigma* as numbers, so that it runs again without the file of the strengths.
  reader.set("Bond", "Strength", "given");
  reader.set("Bond", "Tensile strength", result.bond.R_n);
  reader.set("Bond", "Shear strength", result.bond.R_t);
  reader.set("Rock", "Tensile strength", result.activation.tensile_strength);
  reader.set("Rock", "Compressive strength", result.activation.compressive_strength);
  reader.set("Adaptivity", "Sigma star", result.activation.sigma_star);
  std::ostringstream echo;
  handler.print_parameters(echo, dealii::ParameterHandler::Text);
  result.used_parameters = echo.str();
  return result;
}

void write_parameter_reference(std::ostream &out)
{
  out << "# Parameters of a case\n\nWritten by `kerf params`. All values in SI units; `--set Section/Key=value` overrides the "
         "file.\n";
  std::string section;
  for (const Parameter &parameter : parameter_table())
  {
    if (parameter.section != section)
    {
      section = parameter.section;
      out << "\n## " << section << "\n\n| key | unit | default | allowed | meaning |\n|---|---|---|---|---|\n";
    }
    out << "| " << parameter.key << " | " << parameter.unit << " | "
        << (parameter.default_value.empty() ? "" : "`" + parameter.default_value + "`") << " | " << parameter.allowed << " | "
        << parameter.meaning << (parameter.source.empty() ? "" : " (" + parameter.source + ")") << " |\n";
  }
}
} // namespace kerf
