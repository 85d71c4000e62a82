// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/stand_alone/script_forces.h"

#include "coupler/application/case_file/case_file.h"
#include "coupler/base/errors.h"
#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/loading/tool/tool.h"

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <unordered_map>
#include <utility>

namespace kerf
{
namespace
{
using Eigen::Vector3d;

/// Reads the words 'KEY value...' in a fixed order. Throws InputError.
class Words
{
public:
  Words(const std::vector<std::string> &words, std::string usage) : words(words), usage(std::move(usage)) {}
  std::string text(const std::string &key = "")
  {
    if (!key.empty() && next() != key)
      fail("'" + words[at - 1] + "' where " + key + " is expected");
    return next();
  }
  double number(const std::string &key = "")
  {
    const std::string value = text(key);
    char *end = nullptr;
    const double result = std::strtod(value.c_str(), &end);
    if (end == value.c_str() || *end != '\0' || !std::isfinite(result))
      fail("'" + value + "' is not a number");
    return result;
  }
  double not_negative(const std::string &key)
  {
    const double value = number(key);
    if (value < 0.)
      fail(key + " must not be negative");
    return value;
  }
  void end() const
  {
    if (at != words.size())
      fail("'" + words[at] + "' is unexpected");
  }
  [[noreturn]] void fail(const std::string &what) const { throw InputError(what + ", give " + usage); }

private:
  const std::string &next()
  {
    if (at == words.size())
      fail("a word is missing");
    return words[at++];
  }
  const std::vector<std::string> &words;
  std::string usage;
  std::size_t at = 0;
};

class ToolForce final : public dem::ScriptForce
{
public:
  /// A script has no finite elements, so diameter and density of the surface contact have no effect.
  ToolForce(const ToolSettings &settings, double k_n, MPI_Comm comm) : tool(settings, 2, k_n, 1., 1., comm)
  {
    if (!tool.present())
      throw InputError("the case has no tool");
  }
  void apply(dem::Phase phase, dem::Particles &particles, double time, double dt) override
  {
    tool.set_time_step(dt, 0.);
    if (phase == dem::Phase::step)
      tool.move_to(time);
    tool.apply(particles, nullptr);
  }
  int n_values() const override { return 4; }
  std::vector<double> values() const override
  {
    const Tool::Load load = tool.total(tool.local_load());
    return {-load.force[0], -load.force[1], -load.force[2], load.power};
  }

private:
  Tool tool;
};

std::unique_ptr<dem::ScriptForce> make_tool(const std::vector<std::string> &arguments, MPI_Comm comm)
{
  Words words(arguments, "'case DIRECTORY k_n STIFFNESS', and for platens their faces at the start 'platens LOWER UPPER'");
  ToolSettings settings = read_tool_of_case(words.text("case"));
  const double k_n = words.not_negative("k_n");
  if (settings.kind == ToolKind::platens)
  {
    settings.lower = words.number("platens");
    settings.upper = words.number();
  }
  words.end();
  return std::make_unique<ToolForce>(settings, k_n, comm);
}

class DashpotForce final : public dem::ScriptForce
{
public:
  DashpotForce(const Vector3d &normal, double Z_p, double Z_s, std::unordered_map<int, double> areas)
    : normal(normal), Z_p(Z_p), Z_s(Z_s), areas(std::move(areas))
  {
  }
  void apply(dem::Phase, dem::Particles &particles, double, double) override
  {
    for (int i = 0; i < particles.n; ++i)
      if (const auto area = areas.find(particles.index[i]); area != areas.end())
        particles.force.col(i) += dashpot_force({normal, area->second}, Z_p, Z_s, particles.velocity.col(i));
  }

private:
  Vector3d normal;
  double Z_p, Z_s;
  std::unordered_map<int, double> areas; // by index in the packing
};

std::unique_ptr<dem::ScriptForce> make_dashpot(const std::vector<std::string> &arguments, MPI_Comm)
{
  Words words(arguments, "'normal X Y Z Z_p IMPEDANCE Z_s IMPEDANCE areas FILE'");
  Vector3d normal;
  normal[0] = words.number("normal");
  normal[1] = words.number();
  normal[2] = words.number();
  const double Z_p = words.not_negative("Z_p"), Z_s = words.not_negative("Z_s");
  const std::string name = words.text("areas");
  words.end();
  if (!(normal.norm() > 0.))
    words.fail("the normal is zero");
  std::ifstream file(name);
  std::unordered_map<int, double> areas;
  int tag = 0;
  for (double area = 0.; file >> tag >> area;)
    areas[tag - 1] = area;
  if (areas.empty() || !file.eof())
    words.fail(name + " cannot be read as lines of tag and area");
  return std::make_unique<DashpotForce>(normal.normalized(), Z_p, Z_s, std::move(areas));
}
} // namespace

const std::map<std::string, dem::ScriptForceMaker> &script_forces()
{
  static const std::map<std::string, dem::ScriptForceMaker> forces = {{"kerf/tool", make_tool}, {"kerf/dashpot", make_dashpot}};
  return forces;
}

int run_liggghts(int argc, char **argv, MPI_Comm comm)
{
  dem::run_script(argc, argv, comm, script_forces());
  return 0;
}
} // namespace kerf
