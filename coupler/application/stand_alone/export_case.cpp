// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/stand_alone/export_case.h"

#include "coupler/application/output/results_directory.h"
#include "coupler/application/output/written.h"
#include "coupler/application/setup/problem.h"
#include "coupler/application/setup/time_step.h"
#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>

namespace kerf
{
namespace
{
using Eigen::Vector3d;

/// Writes numbers exactly with the fewest characters.
class ExactStream
{
public:
  explicit ExactStream(std::ostream &out) : out(out) {}
  template <typename T>
  ExactStream &operator<<(const T &item)
  {
    if constexpr (std::is_same_v<T, double>)
    {
      char text[32];
      out.write(text, std::to_chars(text, text + sizeof text, item + 0.).ptr - text); // + 0 removes the sign of minus zero
    }
    else
      out << item;
    return *this;
  }

private:
  std::ostream &out;
};

bool same(const ParticleBoundary::Role &a, const ParticleBoundary::Role &b)
{
  return a.held == b.held && a.driver == b.driver && a.blocked == b.blocked;
}

/// Parts of particles of absorbing faces with one normal.
struct AbsorbingSide
{
  Vector3d normal;
  std::vector<std::pair<int, double>> areas; // tag, area
};

std::string areas_name(std::size_t number)
{
  return "absorb_" + std::to_string(number + 1) + ".data";
}

/// A word of a script that may hold blanks. Throws InputError when LIGGGHTS cannot read it.
std::string quoted(const std::string &word)
{
  if (word.find_first_of(" \t#$&\"'") == std::string::npos)
    return word;
  if (word.find_first_of("\"\n") != std::string::npos)
    throw InputError("the path " + word + " holds a quotation mark or a line break, which scripts of LIGGGHTS cannot name");
  return '"' + word + '"';
}

/// Writes the script. Particles with the same boundary role form a LIGGGHTS type, so that groups take one line.
class ScriptWriter
{
public:
  explicit ScriptWriter(const ScriptContents &contents)
    : c(contents), flat(contents.packing.dim == 2), box(dem::engine_box(contents.particles))
  {
    types.emplace_back();
    for (int i = 0; i < c.packing.size(); ++i)
    {
      const ParticleBoundary::Role &role = c.boundary.role(i);
      std::size_t type = 0;
      while (type < types.size() && !same(types[type], role))
        ++type;
      if (type == types.size())
        types.push_back(role);
      type_of.push_back(static_cast<int>(type) + 1);
    }
  }

  void write_particles(ExactStream &out) const
  {
    out << "# particles of " << c.settings.name << ": tag = index in the store + 1\n\n"
        << c.packing.size() << " atoms\n"
        << types.size() << " atom types\n\n"
        << box.lower[0] << ' ' << box.upper[0] << " xlo xhi\n"
        << box.lower[1] << ' ' << box.upper[1] << " ylo yhi\n"
        << box.lower[2] << ' ' << box.upper[2] << " zlo zhi\n\n"
        << "Atoms\n\n";
    for (int i = 0; i < c.packing.size(); ++i)
      out << i + 1 << ' ' << type_of[i] << ' ' << 2. * c.packing.radii[i] << ' ' << c.particles.density << ' '
          << c.packing.positions(0, i) << ' ' << c.packing.positions(1, i) << ' ' << c.packing.positions(2, i) << '\n';
  }

  std::vector<AbsorbingSide> absorbing_sides() const
  {
    std::vector<AbsorbingSide> sides;
    for (int i = 0; i < c.packing.size(); ++i)
      for (const ParticleBoundary::Dashpot &dashpot : c.boundary.role(i).dashpots)
      {
        const auto same_normal = [&](const AbsorbingSide &side) { return (side.normal - dashpot.normal).norm() <= 1e-9; };
        auto side = std::find_if(sides.begin(), sides.end(), same_normal);
        if (side == sides.end())
          side = sides.insert(sides.end(), {dashpot.normal, {}});
        if (!side->areas.empty() && side->areas.back().first == i + 1)
          side->areas.back().second += dashpot.area;
        else
          side->areas.emplace_back(i + 1, dashpot.area);
      }
    return sides;
  }

  void write(ExactStream &out, const std::string &store) const
  {
    write_head(out);
    write_bond(out, store);
    write_external_forces(out);
    write_motion(out);
    write_output(out);
  }

private:
  /// "type 2 5" for all types that satisfy the condition; empty when there is none.
  template <typename Condition>
  std::string types_with(const Condition &condition) const
  {
    std::string list;
    for (std::size_t t = 1; t < types.size(); ++t)
      if (condition(types[t]))
        list += ' ' + std::to_string(t + 1);
    return list.empty() ? "" : "type" + list;
  }

  void write_head(ExactStream &out) const
  {
    out << "# " << c.settings.name << ": mode dem of kerf, " << c.packing.size() << " particles; SI units"
        << (flat ? ", per metre of thickness" : "") << "\n# Run it here with: kerf liggghts -in " << script_name << "\n\n"
        << "units         si\n"
        << "dimension     " << c.packing.dim << "\n"
        << "atom_style    granular\n"
        << "atom_modify   map array\n"
        << "boundary      " << box.boundary[0] << ' ' << box.boundary[1] << ' ' << box.boundary[2] << "\n"
        << "newton        off\n"
        << "communicate   single vel yes\n"
        << "read_data     particles.data\n"
        << "neighbor      " << 0.25 * c.packing.mean_diameter << " bin\n"
        << "neigh_modify  delay 0 every 1 check yes\n\n";
  }

  void write_bond(ExactStream &out, const std::string &store) const
  {
    const dem::BondParameters &bond = c.settings.bond;
    out << "# Bonds come from the store (particle = tag - 1); k in N/m, R in N" << (flat ? ", per metre" : "") << "\n"
        << "pair_style    gran model kerf_rock_bond &\n"
        << "              k_n " << bond.k_n << " k_t " << bond.k_t << " R_n " << bond.R_n << " R_t " << bond.R_t << " &\n"
        << "              shear_friction " << bond.shear_friction << " friction " << bond.friction << " damping "
        << bond.damping << " local_damping " << c.settings.local_damping << " &\n"
        << "              store " << quoted(store) << "\n"
        << "pair_coeff    * *\n"
        << "timestep      " << c.particles.time_step << "\n\n";
  }

  void write_external_forces(ExactStream &out) const
  {
    const ToolSettings &tool = c.settings.tool;
    if (!c.tool_case.empty())
    {
      out << "# The tool of case.prm (section Tool). f_tool[1..3]: force of the rock on it, f_tool[4]: its power\n"
          << "fix           tool all kerf/tool case " << c.tool_case << " k_n " << c.settings.bond.k_n;
      if (tool.kind == ToolKind::platens)
        out << " platens " << tool.lower << ' ' << tool.upper;
      out << "\n\n";
    }
    const std::vector<AbsorbingSide> sides = absorbing_sides();
    if (!sides.empty())
      out << "# Absorbing boundary: dashpots of the impedances rho c_p and rho c_s, on the areas in the files\n";
    for (std::size_t n = 0; n < sides.size(); ++n)
      out << "fix           absorb_" << n + 1 << " all kerf/dashpot normal " << sides[n].normal[0] << ' ' << sides[n].normal[1]
          << ' ' << sides[n].normal[2] << " Z_p " << c.boundary.impedance_p() << " Z_s " << c.boundary.impedance_s()
          << " areas " << areas_name(n) << "\n";
    out << (sides.empty() ? "" : "\n");
  }

  void write_motion(ExactStream &out) const
  {
    for (int axis = 0; axis < 3; ++axis)
    {
      const std::string list = types_with([&](const ParticleBoundary::Role &role) { return role.blocked[axis]; });
      const char name = "xyz"[axis];
      if (!list.empty())
        out << "# Roller: no motion along " << name << "\n"
            << "group         roller_" << name << ' ' << list << "\n"
            << "fix           roller_" << name << " roller_" << name << " setforce " << (axis == 0 ? "0 " : "NULL ")
            << (axis == 1 ? "0 " : "NULL ") << (axis == 2 ? "0" : "NULL") << "\n\n";
    }
    const std::string held = types_with([](const ParticleBoundary::Role &role) { return role.held; });
    if (!held.empty())
      out << "# Fixed and driven particles: no forces, no rotation\n"
          << "group         held " << held << "\n"
          << "fix           hold held freeze\n\n";
    const std::string driven = types_with([](const ParticleBoundary::Role &role) { return role.driver >= 0; });
    if (!driven.empty())
    {
      // LIGGGHTS moves the particles of a step with one velocity: that at its middle.
      out << "# Driven particles: the velocity increases over a half cosine; each step uses the velocity at its middle\n"
          << "variable      t equal step*" << c.particles.time_step << "-" << 0.5 * c.particles.time_step << "\n";
      for (std::size_t k = 0; k < c.settings.body.boundary_conditions.size(); ++k)
        write_driver(out, static_cast<int>(k));
      out << "group         driven " << driven << "\n"
          << "group         moving subtract all driven\n\n";
    }
    out << "fix           motion " << (driven.empty() ? "all" : "moving") << " nve/sphere\n"
        << (flat ? "fix           plane all enforce2d\n" : "") << "\n";
  }

  void write_driver(ExactStream &out, int condition) const
  {
    const std::string list = types_with([&](const ParticleBoundary::Role &role) { return role.driver == condition; });
    if (list.empty())
      return;
    const fem::BoundaryCondition &motion = c.settings.body.boundary_conditions[condition];
    const std::string number = std::to_string(condition + 1);
    out << "variable      ramp_" << number << " equal ";
    if (motion.ramp > 0.)
      out << "(v_t<" << motion.ramp << ")*0.5*(1-cos(PI*v_t/" << motion.ramp << "))+(v_t>=" << motion.ramp << ")\n";
    else
      out << "1\n";
    for (int axis = 0; axis < c.packing.dim; ++axis)
      out << "variable      v"
          << "xyz"[axis] << '_' << number << " equal v_ramp_" << number << "*(" << motion.velocity[axis] << ")\n";
    out << "group         driven_" << number << ' ' << list << "\n"
        << "fix           drive_" << number << " driven_" << number << " move variable NULL NULL NULL v_vx_" << number
        << " v_vy_" << number << (flat ? " NULL" : " v_vz_" + number) << " units box\n";
  }

  void write_output(ExactStream &out) const
  {
    const std::int64_t interval = std::max<std::int64_t>(1, c.n_steps / std::max(1, c.settings.n_snapshots));
    out << "# Energies [J] of f_rock_bond: 1 kinetic, 2 elastic, 3 damping, 4 friction, 5 released; bonds: 6 intact, 7 broken\n"
        << "thermo_style  custom step atoms f_rock_bond[1] f_rock_bond[2] f_rock_bond[3] f_rock_bond[4] f_rock_bond[5] &\n"
        << "              f_rock_bond[6] f_rock_bond[7]" << (c.tool_case.empty() ? "" : " f_tool[1] f_tool[2]") << "\n"
        << "thermo        " << c.settings.history_interval << "\n"
        << "thermo_modify lost ignore norm no\n"
        << "dump          particles all custom " << interval
        << " particles.dump id type radius x y z vx vy vz omegax omegay omegaz f_kerf_broken\n"
        << "dump_modify   particles sort id format \"%d %d %.10g %.10g %.10g %.10g %.10g %.10g %.10g %.10g %.10g %.10g %g\"\n\n"
        << "run           " << c.n_steps << "\n";
  }

  const ScriptContents &c;
  const bool flat;
  const dem::EngineBox box;
  std::vector<ParticleBoundary::Role> types; // the first one is without boundary condition
  std::vector<int> type_of;                  // by index in the packing, numbered from 1
};
} // namespace

void write_script(const ScriptContents &contents, const std::string &directory)
{
  namespace fs = std::filesystem;
  const ScriptWriter writer(contents);
  const auto open = [&](const std::string &name)
  {
    std::ofstream file(fs::path(directory) / name);
    if (!file)
      throw InputError(directory + "/" + name + " cannot be written");
    return file;
  };
  std::ofstream script = open(script_name), particles = open("particles.data");
  ExactStream script_stream(script), particle_stream(particles);
  writer.write(script_stream,
               fs::proximate(fs::weakly_canonical(contents.settings.packing_file), fs::weakly_canonical(directory)).string());
  writer.write_particles(particle_stream);
  check_written(script, directory + "/" + script_name);
  check_written(particles, directory + "/particles.data");
  const std::vector<AbsorbingSide> sides = writer.absorbing_sides();
  for (std::size_t n = 0; n < sides.size(); ++n)
  {
    std::ofstream file = open(areas_name(n));
    ExactStream areas(file);
    for (const auto &[tag, area] : sides[n].areas)
      areas << tag << ' ' << area << '\n';
    check_written(file, directory + "/" + areas_name(n));
  }
}

int export_case(const RunOptions &options, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  Console console(rank == 0);
  const Case settings = options.read();
  const std::string directory = options.output.empty() ? "results/" + settings.name + "_liggghts" : options.output;
  const std::string script = directory + "/" + script_name;
  check_results_directory(directory, options.case_directory, options.overwrite);

  const auto given_force = [](const fem::BoundaryCondition &condition)
  { return condition.kind == fem::BoundaryKind::traction || condition.kind == fem::BoundaryKind::in_situ; };
  if (settings.body.gravity.norm() > 0. || settings.body.initial_stress.norm() > 0. ||
      std::any_of(settings.body.boundary_conditions.begin(), settings.body.boundary_conditions.end(), given_force))
    throw InputError(settings.directory + "/case.prm: Loads and tractions cannot be exported, only cases without them");
  if (settings.tool.pulls()) // the script's fix does not know the stored packing, whose particles the platens hold
    throw InputError(settings.directory + "/case.prm: Tool/Closing speed < 0 cannot be exported, give a speed > 0");

  const std::unique_ptr<Problem> made = set_up_problem(settings, Mode::dem, console, comm);
  const Problem &scene = *made;
  prepare_results_directory(directory, options.case_directory, options.overwrite, comm);
  const ParticleBoundary boundary(scene.fem->mesh(), settings.body.material, settings.body.boundary_conditions, scene.packing,
                                  settings.body.surface_spacing);
  const Tool tool(scene.settings.tool, scene.packing.dim, scene.settings.bond.k_n, scene.packing.mean_diameter,
                  settings.body.material.density, comm);
  const ScriptContents contents{scene.settings,
                                scene.packing,
                                boundary,
                                particle_settings(scene.settings, scene.packing, scene.dt, comm),
                                number_of_steps(settings.end_time, scene.dt),
                                tool.present() ? "." : ""};
  on_first_rank(comm,
                [&]
                {
                  std::ofstream echo(directory + "/case.prm");
                  check_written(echo << settings.used_parameters, directory + "/case.prm");
                  write_script(contents, directory);
                });
  console.message("wrote " + script + ", particles.data and case.prm; run it there with: kerf liggghts -in " + script_name);
  return 0;
}
} // namespace kerf
