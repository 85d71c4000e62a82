// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/commands/commands.h"
#include "coupler/application/output/results_directory.h"
#include "coupler/application/setup/problem.h"
#include "coupler/application/setup/time_step.h"
#include "coupler/base/mesh_geometry.h"

#include "coupler/base/mpi_helpers.h"
#include <cmath>
#include <iomanip>
#include <sstream>

namespace kerf
{
namespace
{
/// Particle-steps per second on one rank, for the estimate of the run time. This is a conservative value from the benchmarks of
/// the particle side.
constexpr double estimated_particle_steps = 3e6;

/// Cells within one cell size of the tool on its path.
std::vector<int> cells_on_the_way(const Case &settings, const fem::Mesh &mesh)
{
  const ToolPath path(settings.tool.path, settings.tool.smoothing_time);
  std::vector<int> cells;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int k = 0; k <= 200; ++k)
    {
      const Eigen::Vector3d centre = path.position(settings.end_time * k / 200.);
      if (distance_to_cell(mesh, cell, centre) < settings.tool.radius + settings.body.mesh.cell_size)
      {
        cells.push_back(cell);
        break;
      }
    }
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

int check_case(const RunOptions &options, MPI_Comm comm)
{
  const int rank = rank_of(comm);
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  Console console(rank == 0);
  const Case settings = read_case(options.case_directory, options.overrides);
  const Mode mode = options.mode.value_or(settings.mode);
  const auto problem = set_up_problem(settings, mode, console, comm);

  const auto steps = static_cast<double>(number_of_steps(problem->settings.end_time, problem->dt));
  const int n_particles = count_particles(*problem, mode);
  const double fem_step = mode == Mode::dem ? 0. : seconds_of_fem_step(*problem->fem, problem->dt);
  // The number of particles of an adaptive run grows about linearly.
  const double mean_particles = mode == Mode::adaptive ? 0.5 * n_particles : n_particles;
  const double run_time = steps * (fem_step + mean_particles / (estimated_particle_steps * n_ranks));
  // Bytes for a stored particle with its bonds, an active one with lists and history, and a cell with its batch and nodes.
  const double memory = 100e6 + 120. * problem->packing.size() + 2500. * n_particles + 1500. * problem->fem->mesh().n_cells();

  std::ostringstream text;
  text << std::setprecision(4) << "case " << problem->settings.name << ", mode " << name_of(mode) << ": valid\n"
       << packing_summary(problem->packing) << "\n"
       << problem->settings.strength_summary << "\n"
       << "cells            " << problem->fem->mesh().n_cells() << ", nodes " << problem->fem->mesh().n_nodes() << "\n"
       << "particles        " << problem->packing.size() << " stored, about " << n_particles << " active at the end\n"
       << "overlap          " << problem->settings.overlap.width
       << " m = " << problem->settings.overlap.width / problem->settings.packing.mean_diameter << " d\n"
       << "stable step      finite elements " << problem->stable.fem << " s, particles " << problem->stable.dem
       << " s, this mode " << problem->stable.coupled << " s\n"
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
  const Case settings = read_case(options.case_directory, options.overrides);
  const std::unique_ptr<fem::FemSide> fem = build_fem(settings, comm);
  dem::Packing packing;
  build_packing(settings, *fem, packing, console, comm);
  console.message(settings.packing_file + "\n" + packing_summary(packing));
  return 0;
}
} // namespace kerf
