// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/commands/commands.h"
#include "coupler/application/output/results_directory.h"
#include "coupler/application/setup/packing_domain.h"
#include "coupler/application/setup/problem.h"
#include "coupler/application/setup/size_limits.h"
#include "coupler/application/setup/time_step.h"
#include "coupler/base/mesh_geometry.h"

#include "coupler/base/mpi_helpers.h"
#include <cmath>
#include <filesystem>
#include <iomanip>
#include <sstream>

namespace kerf
{
namespace
{
/// Particle-steps per second on one rank, for the estimate of the run time. This is a conservative value from the benchmarks of
/// the particle side.
constexpr double estimated_particle_steps = 3e6;

/// Distance from the contact up to which the stress measure exceeds sigma* [m]. The contact is as wide as the disc is deep in
/// the rock and carries its compressive strength; below such a load the stress is radial, 2 P/(pi r) in the plane (Flamant) and
/// 3 P/(2 pi r^2) in space (Boussinesq). Cracks run farther: in disc_cutter_2d and the tests' small cut it is
/// right within a factor of 1.5 at the end, in rock that splits it is too small.
double reach_of_stress(const Case &settings, double depth)
{
  const double R = settings.tool.radius, width = 2. * std::sqrt(std::max(0., 2. * R * depth - depth * depth));
  // The Mohr-Coulomb measure of a compression p is p f_t/f_c: the compressive strength cancels.
  const double load = settings.activation.tensile_strength / settings.activation.sigma_star * width;
  if (settings.dim() == 2)
    return 2. * load / M_PI;
  const double along_axis = settings.tool.width > 0. ? settings.tool.width : width;
  return std::sqrt(1.5 * load * along_axis / M_PI);
}

/// Cells that the tool touches on its path or loads beyond sigma*.
std::vector<int> cells_on_the_way(const Case &settings, const fem::Mesh &mesh)
{
  const ToolPath path(settings.tool.path, settings.tool.smoothing_time);
  const double surface = mesh_box(mesh).upper[1], R = settings.tool.radius;
  std::vector<char> found(mesh.n_cells(), 0);
  constexpr int n_places = 200;
  for (int k = 0; k <= n_places; ++k)
  {
    const Eigen::Vector3d centre = path.position(settings.end_time * k / n_places);
    const double depth = std::min(surface - (centre[1] - R), R);
    if (depth <= 0.)
      continue;
    const double reach = reach_of_stress(settings, depth);
    Eigen::Vector3d contact = centre;
    contact[1] -= R;
    for (int cell = 0; cell < mesh.n_cells(); ++cell)
      found[cell] |= distance_to_cell(mesh, cell, centre) < R || distance_to_cell(mesh, cell, contact) < reach;
  }
  std::vector<int> cells;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (found[cell])
      cells.push_back(cell);
  return cells;
}

/// Estimated number of active particles at the end of a run.
int count_particles(const Problem &problem, Mode mode)
{
  if (mode == Mode::fem)
    return 0;
  if (mode == Mode::dem)
    return problem.packing.size();
  const fem::Mesh &mesh = problem.fem->mesh();
  const Eigen::Matrix3Xd no_points(3, 0);
  Overlap overlap(mesh, no_points, no_points, problem.packing, problem.settings.overlap.weight_function,
                  problem.settings.overlap.width);
  if (mode == Mode::fixed)
    overlap.convert(cells_inside(mesh, problem.settings.fixed_region));
  else if (problem.settings.tool.kind == ToolKind::disc)
    overlap.convert(cells_on_the_way(problem.settings, mesh));
  int n = 0;
  for (int i = 0; i < problem.packing.size(); ++i)
    n += overlap.needs_particle(i);
  return n;
}

double seconds_of_fem_step(fem::FemSide &fem, double dt)
{
  constexpr int repeats = 20;
  const double start = MPI_Wtime();
  for (int k = 0; k < repeats; ++k)
  {
    fem.begin_step(dt, 0.);
    fem.compute_forces();
    fem.end_step(dt, 0.);
  }
  return (MPI_Wtime() - start) / repeats;
}
} // namespace

namespace
{
/// What can be said of a case without its store, which takes minutes to make.
int check_without_store(const Case &settings, Mode mode, Console &console, MPI_Comm comm)
{
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  const auto problem = set_up_mesh(settings, mode, console, comm);
  const double n = estimate_particles(settings.packing, find_packing_domain(settings, problem->fem->mesh()).volume);
  check_particle_number(settings, n, n_ranks);
  std::ostringstream text;
  text << std::setprecision(4) << "case " << settings.name << ", mode " << name_of(mode) << ": valid as far as it is known\n"
       << settings.strength_summary << "\n"
       << "cells            " << problem->fem->mesh().n_cells() << ", nodes " << problem->fem->mesh().n_nodes() << "\n"
       << "particles        about " << n << " to be stored\n"
       << "stable step      finite elements " << problem->fem->stable_step() << " s\n"
       << "memory           at most about " << std::ceil((bytes_of_program() + bytes_of_particle(settings.dim()) * n) / 1e6)
       << " MB\n"
       << settings.packing_file
       << " does not exist yet: kerf check --pack or kerf pack makes it; then time step and run time are known";
  console.message(text.str());
  return 0;
}
} // namespace

int check_case(const RunOptions &options, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  Console console(rank == 0);
  const Case settings = options.read();
  const Mode mode = options.mode.value_or(settings.mode);
  if (mode != Mode::fem && !options.pack && !std::filesystem::exists(settings.packing_file))
    return check_without_store(settings, mode, console, comm);
  const auto problem = set_up_problem(settings, mode, console, comm);

  const auto steps = static_cast<double>(number_of_steps(problem->settings.end_time, problem->dt));
  const int n_particles = count_particles(*problem, mode);
  const double fem_step = mode == Mode::dem ? 0. : seconds_of_fem_step(*problem->fem, problem->dt);
  // The number of particles of an adaptive run grows at once where the tool enters and slowly later: 0.8 of the last number on
  // average in cases/disc_cutter_2d.
  const double mean_particles = mode == Mode::adaptive ? 0.8 * n_particles : n_particles;
  const double run_time = steps * (fem_step + mean_particles / (estimated_particle_steps * n_ranks));
  const double memory = bytes_of_program() + bytes_of_stored_particle() * problem->packing.size() +
                        bytes_of_particle(settings.dim()) * n_particles +
                        bytes_of_cell(settings.dim()) * problem->fem->mesh().n_cells();
  check_particle_number(settings, n_particles, n_ranks);

  std::ostringstream text;
  const auto number = [](double value)
  {
    std::ostringstream digits;
    digits << std::setprecision(4) << value;
    return digits.str();
  };
  std::ostringstream particles;
  if (mode != Mode::fem)
    particles << std::setprecision(4) << "particles        " << problem->packing.size() << " stored, about " << n_particles
              << " active at the end\n"
              << "overlap          " << problem->settings.overlap.width
              << " m = " << problem->settings.overlap.width / problem->settings.packing.mean_diameter << " d\n";
  text << std::setprecision(4) << "case " << problem->settings.name << ", mode " << name_of(mode) << ": valid\n"
       << (mode == Mode::fem ? "" : packing_summary(problem->packing) + "\n" + problem->settings.strength_summary + "\n")
       << "cells            " << problem->fem->mesh().n_cells() << ", nodes " << problem->fem->mesh().n_nodes() << "\n"
       << particles.str() << "stable step      finite elements " << problem->stable.fem << " s, "
       << (mode == Mode::fem ? "" : "particles " + number(problem->stable.dem) + " s, ") << "this mode "
       << problem->stable.coupled << " s\n"
       << "time step        " << problem->dt << " s, " << steps << " steps to " << problem->settings.end_time << " s\n"
       << "memory           about " << std::ceil(memory / 1e6) << " MB\n"
       << "run time         about " << clock_text(run_time) << " on " << n_ranks << (n_ranks == 1 ? " rank" : " ranks");
  console.message(text.str());
  return 0;
}

int pack_case(const RunOptions &options, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  Console console(rank == 0);
  const Case settings = options.read();
  const std::unique_ptr<fem::FemSide> fem = build_fem(settings, comm);
  dem::Packing packing;
  build_packing(settings, *fem, packing, StoreUse::recalibrated, console, comm);
  console.message(settings.packing_file + "\n" + packing_summary(packing));
  return 0;
}
} // namespace kerf
