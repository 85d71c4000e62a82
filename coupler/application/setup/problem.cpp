// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/problem.h"

#include "coupler/application/setup/case_checks.h"
#include "coupler/application/setup/packing_domain.h"
#include "coupler/application/setup/size_limits.h"
#include "coupler/application/setup/time_step.h"
#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/contact_criterion.h"
#include "dem_side/bond_network/bond_network.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <iomanip>
#include <limits>
#include <sstream>
#include <unistd.h>

namespace kerf
{
namespace
{
/// The key of the case that an error of the finite elements is about, which its text begins with; otherwise the mesh.
std::string key_of(const std::string &what)
{
  static const std::vector<std::pair<std::string, std::string>> keys = {{"boundary condition", "Boundary/Conditions: "},
                                                                        {"initial stress", "Loads/Initial stress: "},
                                                                        {"mesh file", "Mesh/File: "},
                                                                        {"rock", "Rock: "}};
  for (const auto &[start, key] : keys)
    if (what.rfind(start, 0) == 0)
      return key;
  return "Mesh: ";
}

/// Runs @p action and converts its errors to InputErrors that begin with the place in the case. Programming errors pass
/// through. @param place function of the error's text
template <typename Place, typename Action>
auto as_input_error(const Place &place, const Action &action)
{
  try
  {
    return action();
  }
  catch (const std::exception &error)
  {
    if (is_bug(error))
      throw;
    throw InputError(place(error_line(error)) + error_line(error));
  }
}

std::string case_path(const Case &settings)
{
  return settings.directory + "/case.prm";
}

/// Of the moments of one body with different facets: round-off, also of coordinates far from the origin [-].
constexpr double shape_tolerance = 1e-8;

/// Difference between a stored packing and the case, in words; empty when the packing fits. Values that are not numbers differ.
std::string mismatch(const dem::Packing &packing, const Case &settings, const PackingDomain &space)
{
  const dem::PackingSettings &wanted = settings.packing;
  const auto differs = [](double a, double b, double scale) { return !(std::abs(a - b) <= 1e-6 * scale); };
  std::ostringstream text;
  const auto compare = [&](const char *name, double stored, const char *key, double asked)
  {
    if (text.str().empty() && differs(stored, asked, asked))
      text << "was made with " << name << ' ' << stored << ", " << key << " asks for " << asked;
  };
  const bool is_random = wanted.kind == "random";
  if (packing.dim != settings.dim())
    text << "holds a packing of " << packing.dim << " dimensions, Mesh/Dimension asks for " << settings.dim();
  else if (packing.kind != wanted.kind)
    text << "holds a " << packing.kind << " packing, Packing/Kind asks for " << wanted.kind;
  else if (is_random && std::isnan(packing.asked.radius_spread))
    text << "is of an earlier version and does not say for which Packing/Radius spread it was made";
  const bool is_old = std::isnan(packing.asked.radius_spread); // a lattice attains what was asked for
  compare("mean diameter", is_old ? packing.mean_diameter : packing.asked.mean_diameter, "Packing/Mean diameter",
          wanted.mean_diameter);
  compare("gap tolerance", is_old ? packing.gap_tolerance : packing.asked.gap_tolerance, "Packing/Gap tolerance",
          wanted.gap_tolerance);
  if (is_random)
  {
    compare("radius spread", packing.asked.radius_spread, "Packing/Radius spread", wanted.radius_spread);
    compare("seed", packing.seed, "Packing/Seed", wanted.seed);
  }
  else if (text.str().empty() && !(packing.lattice == wanted.lattice))
    text << "holds a lattice with another orientation or position than Packing/Lattice rows and Packing/Lattice plane ask for";
  const double d = wanted.mean_diameter;
  for (int c = 0; c < settings.dim(); ++c)
    if (text.str().empty() &&
        (differs(packing.lower[c], space.box.lower[c], d) || differs(packing.upper[c], space.box.upper[c], d)))
      text << "fills " << packing.lower[c] << " to " << packing.upper[c] << " m along "
           << "xyz"[c] << ", the rock " << space.box.lower[c] << " to " << space.box.upper[c];
    else if (text.str().empty() && (packing.periodic[c] > 0.) != wanted.periodic[c])
      text << "is " << (packing.periodic[c] > 0. ? "" : "not ") << "periodic along "
           << "xyz"[c] << ", Mesh/Periodic asks for the opposite";
  const char *key = !settings.packing_surface_file.empty()  ? "Packing/Surface"
                    : !settings.body.mesh.gmsh_file.empty() ? "Mesh/File"
                                                            : "Mesh/Shape";
  if (text.str().empty() && differs(packing.volume_filled, space.volume, space.volume))
    text << "fills a volume of " << packing.volume_filled << ", the rock of " << key << " has " << space.volume
         << ": another shape";
  if (text.str().empty() && packing.shape.empty() && !space.shape.empty())
    text << "is of an earlier version and does not say for which shape it was made";
  bool same_shape = packing.shape.size() == space.shape.size();
  for (std::size_t k = 0; same_shape && k < space.shape.size(); ++k)
    same_shape = std::abs(packing.shape[k] - space.shape[k]) <= shape_tolerance;
  if (text.str().empty() && !same_shape)
    text << "fills another shape than that of " << key;
  return text.str();
}

/// Round-off of a coordinate, relative to cells and particles, that leaves forces and contacts as they are near the origin.
constexpr double largest_round_off = 5e-9;

/// Displacements are differences of coordinates. Far from the origin their last bits are lost.
void check_distance(const Case &settings, const fem::Mesh &mesh)
{
  const double allowed =
    largest_round_off / std::numeric_limits<double>::epsilon() * std::min(settings.packing.mean_diameter, smallest_edge(mesh));
  const double furthest = mesh.nodes.cwiseAbs().maxCoeff();
  if (!(furthest <= allowed))
  {
    std::ostringstream text;
    text << case_path(settings) << ": Mesh: the rock reaches " << furthest
         << " m away from the origin, more than the coordinates can resolve for its cells and particles; allowed are "
         << allowed << " m, move it";
    throw InputError(text.str());
  }
}

void check_overlap(const Case &settings, const fem::FemSide &fem)
{
  const Box box = mesh_box(fem.mesh());
  double extent = box.upper[0] - box.lower[0];
  for (int c = 1; c < settings.dim(); ++c)
    if (!settings.body.mesh.periodic[c])
      extent = std::min(extent, box.upper[c] - box.lower[c]);
  if (settings.overlap.width >= extent)
  {
    std::ostringstream text;
    text << case_path(settings) << ": Coupling/Overlap width = " << settings.overlap.width / settings.packing.mean_diameter
         << " d = " << settings.overlap.width << " m is wider than the mesh, give less than its smallest extent "
         << extent / settings.packing.mean_diameter << " d";
    throw InputError(text.str());
  }
}

void check_tool(const Case &settings, const fem::FemSide &fem)
{
  if (settings.tool.kind != ToolKind::disc)
    return;
  const ToolSettings &tool = settings.tool;
  const double clearance = Tool::clearance(tool, fem);
  const Eigen::Vector3d &first = tool.path.front().second;
  // More than the round-off of a disc that touches the surface, of its radius and of its coordinates.
  if (clearance >= -1e-9 * tool.radius - 1e-14 * first.norm())
    return;
  const double moved = (ToolPath(tool.path, tool.smoothing_time).position(0.) - first).norm();
  std::ostringstream text;
  text << case_path(settings) << ": Tool/Path: the disc starts " << -clearance << " m inside the rock";
  if (moved > 0.)
    text << ", since Tool/Smoothing time has moved the path by " << moved << " m at the start";
  text << "; let the first way point be " << -clearance << " m farther away: at least Tool/Radius";
  if (moved > 0.)
    text << " and the way of the smoothing, " << tool.radius + moved << " m,";
  else
    text << " = " << tool.radius << " m";
  text << " from the rock";
  throw InputError(text.str());
}

/// Median edge of the cells [m].
double typical_edge(const fem::Mesh &mesh)
{
  std::vector<double> edges;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int c = 0; c < mesh.dim; ++c) // lexicographic order: edges join corner 0 to corners 1, 2 and 4
      edges.push_back((mesh.nodes.col(mesh.cells(1 << c, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  const auto middle = edges.begin() + static_cast<std::ptrdiff_t>(edges.size() / 2);
  std::nth_element(edges.begin(), middle, edges.end());
  return *middle;
}

/// A disc that touches cells larger than its contact finds too much resistance. Other modes convert such cells, or have
/// particles.
void warn_of_coarse_contact(const Case &settings, Console &console)
{
  const double half_width = contact_half_width(Disc(settings.tool).curvature_radius(), settings.activation.compressive_strength,
                                               settings.body.material);
  if (half_width >= 2. * settings.body.mesh.cell_size)
    return;
  std::ostringstream text;
  text << "warning: " << (settings.body.mesh.gmsh_file.empty() ? "Mesh/Cell size" : "the median edge of the cells of Mesh/File")
       << " = " << settings.body.mesh.cell_size << " m does not resolve the contact of the disc (half width " << half_width
       << " m at Rock/Compressive strength): in mode fem its force is too large (docs/results/cutting.md)";
  console.message(text.str());
}

/// Stiffness ratio of the contact in mode fem, unless one is given. Steps of cells are long: a contact whose stiffness follows
/// them would be as soft as half a cell.
constexpr double stiffness_ratio_of_cells = 25.;

/// Placeholder packing of mode fem: one particle without bonds that never becomes active. The contact stiffness k_n of the tool
/// is that of a random packing with the relaxed moduli of the rock: E/k_n = 0.83 in two dimensions and E d/(2 k_n) = 0.43 in
/// three (gap tolerance 0.1, k_t/k_n = 0.25).
dem::Packing no_packing(const Case &settings, const Box &body)
{
  dem::Packing packing;
  packing.dim = settings.dim();
  packing.kind = settings.packing.kind;
  packing.mean_diameter = settings.packing.mean_diameter;
  packing.lower = body.lower;
  packing.upper = body.upper;
  packing.positions = 0.5 * (body.lower + body.upper);
  packing.radii = Eigen::VectorXd::Constant(1, 0.5 * packing.mean_diameter);
  packing.volume_filled = packing.volume(0);
  packing.calibration.k_n =
    packing.dim == 2 ? settings.body.material.young / 0.83 : settings.body.material.young * packing.mean_diameter / (2. * 0.43);
  packing.calibration.k_t = 0.25 * packing.calibration.k_n;
  return packing;
}
} // namespace

std::unique_ptr<fem::FemSide> build_fem(const Case &settings, MPI_Comm comm)
{
  int n_ranks = 1;
  MPI_Comm_size(comm, &n_ranks);
  check_mesh_size(settings, n_ranks);
  check_contact_points(settings, n_ranks);
  fem::Settings body = settings.body;
  body.comm = comm;
  auto fem = as_input_error([&](const std::string &what) { return case_path(settings) + ": " + key_of(what); },
                            [&] { return fem::make_fem_side(body); });
  check_distance(settings, fem->mesh());
  return fem;
}

void build_packing(const Case &settings, const fem::FemSide &fem, dem::Packing &packing, StoreUse use, Console &console,
                   MPI_Comm comm)
{
  const PackingDomain space = find_packing_domain(settings, fem.mesh());
  const auto named = [&](const char *section, const auto &action)
  { return as_input_error([&](const std::string &) { return case_path(settings) + ": " + section + ": "; }, action); };
  on_first_rank(
    comm,
    [&]
    {
      if (std::filesystem::exists(settings.packing_file))
        packing = dem::load_packing(settings.packing_file);
      else
      {
        // Generation takes minutes: the file is tried before.
        const std::string folder = std::filesystem::path(settings.packing_file).parent_path().string();
        if (access(folder.empty() ? "." : folder.c_str(), W_OK) != 0)
          throw InputError(shown(settings.packing_file) + ": cannot be written, " + std::strerror(errno));
        check_particle_number(settings, estimate_particles(settings.packing, space.volume), 1);
        dem::PackingSettings target = settings.packing;
        target.lower = space.box.lower;
        target.upper = space.box.upper;
        target.surface = space.surface;
        console.message("generating the packing " + settings.packing_file);
        packing = named("Packing",
                        [&] {
                          return dem::generate_packing(target, [&](double done, const std::string &text)
                                                       { console.progress(done, text); });
                        });
        console.finish_progress();
        dem::save_packing(packing, settings.packing_file);
      }
      const std::string wrong = mismatch(packing, settings, space);
      if (!wrong.empty())
        throw InputError(settings.packing_file + ": " + wrong + "; name another Packing/File or remove the file");

      const dem::ElasticCalibration &known = packing.calibration;
      if (settings.given_stiffness)
        return;
      if (std::abs(known.target_young - settings.body.material.young) > 1e-9 * settings.body.material.young ||
          std::abs(known.target_poisson - settings.body.material.poisson) > 1e-12)
      {
        const bool is_for_another_rock = known.target_young > 0.;
        console.message("calibrating k_n, k_t: static solve of the bond network");
        packing.calibration =
          named("Rock",
                [&] { return dem::calibrate_elastic(packing, settings.body.material.young, settings.body.material.poisson); });
        if (is_for_another_rock && use == StoreUse::kept)
          console.message("notice: " + settings.packing_file +
                          " is calibrated for another Rock/Young modulus or Poisson ratio and stays as it is; kerf pack stores "
                          "the new stiffnesses");
        else
          dem::save_packing(packing, settings.packing_file);
      }
    });
  if (rank_of(comm) != 0)
    packing = dem::load_packing(settings.packing_file);
  MPI_Bcast(&packing.calibration, sizeof packing.calibration, MPI_BYTE, 0, comm);
}

std::string packing_summary(const dem::Packing &packing)
{
  const dem::PackingQuality &quality = packing.quality;
  const dem::ElasticCalibration &elastic = packing.calibration;
  const auto list = [&packing](const Eigen::Vector3d &values, double unit)
  {
    std::ostringstream text;
    text << std::setprecision(4);
    for (int c = 0; c < packing.dim; ++c)
      text << (c ? ", " : "") << values[c] / unit;
    return text.str();
  };
  std::ostringstream text;
  text << std::setprecision(4) << packing.size() << " particles (" << packing.kind << "), mean diameter "
       << packing.mean_diameter << " m, " << packing.bonds.size() << " bonded pairs\n"
       << "solid fraction   " << quality.solid_fraction << ", in the core " << quality.core_solid_fraction << "\n"
       << "coordination     " << quality.coordination << ", in the core " << quality.core_coordination << "\n"
       << "largest overlap  " << 100. * quality.largest_overlap << " % of the mean diameter\n"
       << "fabric           eigenvalues " << list(quality.fabric, 1.) << ", isotropy " << quality.isotropy << "\n"
       << "bonds            k_n = " << elastic.k_n << ", k_t = " << elastic.k_t << " N/m\n"
       << "relaxed moduli   E = " << elastic.achieved_young / 1e9 << " GPa, nu = " << elastic.achieved_poisson
       << "; along the axes E = " << list(elastic.axis_young, 1e9) << " GPa, nu = " << list(elastic.axis_poisson, 1.)
       << "; anisotropy " << 100. * elastic.anisotropy << " %";
  return text.str();
}

std::unique_ptr<Problem> set_up_mesh(const Case &settings, Mode mode, Console &console, MPI_Comm comm)
{
  auto problem = std::make_unique<Problem>();
  problem->settings = settings;
  for (const std::string &notice : settings.notices)
    console.message(notice);
  problem->fem = build_fem(settings, comm);
  if (!settings.body.mesh.gmsh_file.empty()) // Mesh/Cell size says nothing of a file
  {
    problem->settings.body.mesh.cell_size = typical_edge(problem->fem->mesh());
    if (settings.overlap_cells > 0.)
      problem->settings.overlap.width = settings.overlap_cells * problem->settings.body.mesh.cell_size;
  }
  check_settings(problem->settings, mode, problem->fem->mesh());
  for (const std::string &doubt : doubts(problem->settings, mode, problem->fem->mesh()))
    console.message("warning: " + doubt);
  if (settings.tool.kind == ToolKind::platens)
  {
    problem->specimen = find_specimen(settings, problem->fem->mesh(), mode);
    problem->settings.tool.lower = problem->specimen.box.lower[1];
    problem->settings.tool.upper = problem->specimen.box.upper[1];
  }
  if (mode == Mode::adaptive || mode == Mode::fixed)
  {
    check_overlap(problem->settings, *problem->fem);
    if (const double cells = problem->settings.overlap.width / problem->settings.body.mesh.cell_size; cells < 2. - 1e-9)
    {
      std::ostringstream text;
      text << "warning: Coupling/Overlap width is " << cells
           << " cells; in cuts, overlaps of less than two have crumbled the rock in them (docs/results/cutting.md)";
      console.message(text.str());
    }
  }
  if (mode == Mode::fixed && cells_inside(problem->fem->mesh(), settings.fixed_region).empty())
    throw InputError(case_path(settings) + ": Fixed/Region holds no cell, mode fixed needs a region inside the mesh");
  check_tool(settings, *problem->fem);
  if (mode == Mode::fem && settings.tool.kind == ToolKind::disc)
    warn_of_coarse_contact(problem->settings, console);
  return problem;
}

std::unique_ptr<Problem> set_up_problem(const Case &settings, Mode mode, Console &console, MPI_Comm comm)
{
  std::unique_ptr<Problem> problem = set_up_mesh(settings, mode, console, comm);
  if (mode == Mode::fem)
  {
    problem->packing = no_packing(settings, mesh_box(problem->fem->mesh()));
    if (settings.tool.stiffness_ratio == 0.)
      problem->settings.tool.stiffness_ratio = stiffness_ratio_of_cells;
  }
  else
  {
    build_packing(settings, *problem->fem, problem->packing, StoreUse::kept, console, comm);
    if (!settings.packing_surface_file.empty())
      check_conditions_on_surface(settings, problem->fem->mesh(), problem->packing);
  }
  if (!settings.given_stiffness)
  {
    problem->settings.bond.k_n = problem->packing.calibration.k_n;
    problem->settings.bond.k_t = problem->packing.calibration.k_t;
  }

  problem->constraint = make_constraint(constraint_model(problem->settings, problem->packing, comm));
  problem->stable = stable_steps(problem->settings, mode, *problem->fem, problem->packing, *problem->constraint, comm);
  problem->dt = choose_time_step(problem->settings, mode, problem->stable, *problem->fem);
  return problem;
}
} // namespace kerf
