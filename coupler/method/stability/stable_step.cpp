// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/stable_step.h"

#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/loading/tool/tool.h"
#include "coupler/method/activation/activation_rule.h"
#include "dem_side/bond_network/bond_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Stable step of a system that gets a further spring: omega^2 is at most the sum.
double with_spring(double step, double omega2)
{
  return 2. / std::sqrt(4. / (step * step) + omega2);
}

/// Share of the stable step that contact damping leaves. Damping is a fraction xi of critical for a pair; the highest mode of
/// the pack sees it through more contacts, xi_max = xi omega_max sqrt(m/(2 k_n)). Limit with damping: (2/omega) (sqrt(1 + xi^2)
/// - xi).
double left_by_damping(const Case &settings, double omega, double mean_mass)
{
  const double xi = settings.bond.damping * omega * std::sqrt(mean_mass / (2. * settings.bond.k_n));
  return std::sqrt(1. + xi * xi) - xi;
}

double smallest_edge(const fem::Mesh &mesh)
{
  double smallest = 1e300;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int c = 0; c < mesh.dim; ++c) // lexicographic: the neighbours of corner 0 are 1, 2 and 4
      smallest = std::min(smallest, (mesh.nodes.col(mesh.cells(1 << c, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return smallest;
}

/// Stable step when the tool's spring touches the mesh: 2 k_s/(rho h) of a surface node (area a, lumped mass rho a h/2),
/// whatever the cell's shape.
double with_tool_on_surface(const double step, const Case &settings, const fem::Mesh &mesh)
{
  if (!settings.tool.present())
    return step;
  const double k = surface_stiffness(settings.tool, mesh.dim, settings.bond.k_n, settings.packing.mean_diameter);
  return with_spring(step, 2. * k / (settings.rock.density * smallest_edge(mesh)));
}

/// Cells, the overlap around them, and what is tied to its outside by bonds.
Box surroundings(const fem::Mesh &mesh, const std::vector<int> &cells, double reach)
{
  Box box{Eigen::Vector3d::Constant(1e300), Eigen::Vector3d::Constant(-1e300)};
  for (const int cell : cells)
    for (int a = 0; a < mesh.cells.rows(); ++a)
    {
      box.lower = box.lower.cwiseMin(mesh.nodes.col(mesh.cells(a, cell)));
      box.upper = box.upper.cwiseMax(mesh.nodes.col(mesh.cells(a, cell)));
    }
  box.lower.array() -= reach;
  box.upper.array() += reach;
  return box;
}

double reach_around(const Case &settings, const Overlap &overlap)
{
  const double cells = settings.corrector ? 2. : 1.; // strains around a node look a cell farther
  return overlap.width() + cells * settings.mesh.cell_size + 2. * settings.packing.mean_diameter;
}

std::vector<char> particles_of(const Overlap &overlap, int n)
{
  std::vector<char> active(n);
  for (int i = 0; i < n; ++i)
    active[i] = overlap.needs_particle(i);
  return active;
}

/// Stable step of the model with these cells converted; zero if there is none. @p fluctuations are made if there are none.
double limit_of_overlap_around(const std::vector<int> &cells, const Case &settings, fem::FemSide &fem,
                               const dem::Packing &packing, std::shared_ptr<const Fluctuations> &fluctuations, double guess,
                               MPI_Comm comm)
{
  Overlap overlap(fem.mesh(), fem.quadrature_points(), packing, settings.weight_function, settings.overlap_width);
  overlap.convert(cells);
  fem.set_weights(overlap.fe_weights());
  const ParticleBoundary boundary(fem.mesh(), settings.rock, settings.boundary_conditions, packing);
  if (settings.corrector && !fluctuations)
    fluctuations = std::make_shared<Fluctuations>(packing, settings.bond.k_n, settings.bond.k_t, fem);
  const auto corrector = settings.corrector ? std::make_unique<Corrector>(packing, fluctuations, fem) : nullptr;
  CoupledOperator model(settings, fem, packing, overlap, boundary.movable(overlap.tied_particles()),
                        particles_of(overlap, packing.size()), surroundings(fem.mesh(), cells, reach_around(settings, overlap)),
                        comm, corrector.get());
  const double limit = model.stable_step(guess);
  fem.set_weights(Eigen::VectorXd::Ones(fem.quadrature_points().cols()));
  return limit;
}

/// Some cells in the middle of the mesh, for an overlap all around them.
std::vector<int> cells_in_the_middle(const fem::Mesh &mesh, double reach)
{
  const Eigen::Vector3d lower = mesh.nodes.rowwise().minCoeff(), upper = mesh.nodes.rowwise().maxCoeff();
  Eigen::Vector3d middle = cell_centre(mesh, 0); // of the nearest cell: a mesh may have a hole there
  const auto distance = [&](const Eigen::Vector3d &place) { return (place - 0.5 * (lower + upper)).norm(); };
  for (int cell = 1; cell < mesh.n_cells(); ++cell)
    if (const Eigen::Vector3d centre = cell_centre(mesh, cell); distance(centre) < distance(middle))
      middle = centre;
  return cells_inside(mesh, {Box{middle.array() - reach, middle.array() + reach}});
}

/// What ties may add to dt^2 omega^2 where the overlap is not known yet.
double added_by_ties(const Case &settings, double dt, double lightest)
{
  const double damping = settings.interface_damping;
  switch (settings.constraint)
  {
  case ConstraintMethod::multipliers:
    return 2. * settings.fluctuation_relaxation; // of fluctuations, which move no node
  case ConstraintMethod::multipliers_diagonal:
    return 0.;
  case ConstraintMethod::penalty_mass_scaled:
    return settings.penalty_ratio + 4. * damping * std::sqrt(settings.penalty_ratio);
  default:
    const double k = settings.penalty_ratio * settings.bond.k_n;
    return dt * dt * k / lightest + 4. * damping * dt * std::sqrt(k / lightest);
  }
}
} // namespace

double particle_density(const Case &settings, const dem::Packing &packing)
{
  return settings.rock.density / packing.solid_fraction();
}

double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density)
{
  constexpr double pressed = 0.5; // gap / mean radius of pairs that touch where the rock is pressed together
  dem::Packing contacts = packing;
  dem::bond_by_gap(contacts, std::max(pressed, packing.gap_tolerance));
  const double whole = dem::largest_frequency(packing, k_n, k_t, density);
  return contacts.bonds == packing.bonds ? whole : std::max(whole, dem::largest_frequency(contacts, k_n, k_t, density));
}

namespace
{
StableSteps elastic_steps(const Case &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, MPI_Comm comm)
{
  StableSteps steps;
  steps.fem = with_tool_on_surface(fem.stable_step(), settings, fem.mesh());
  if (mode == Mode::fem)
  {
    steps.dem = std::numeric_limits<double>::infinity();
    steps.elastic = steps.fem;
    return steps;
  }
  const double density = particle_density(settings, packing);
  const double omega = particle_frequency(packing, settings.bond.k_n, settings.bond.k_t, density);
  double mean_mass = 0.;
  for (int i = 0; i < packing.size(); ++i)
    mean_mass += density * packing.volume(i) / packing.size();
  const double undamped_share = left_by_damping(settings, omega, mean_mass);
  steps.dem = 2. / omega * undamped_share;

  if (settings.tool.present())
  {
    // The tool's spring adds to the stiffness of what it touches: k/m of the lightest particle.
    const double k = settings.tool.stiffness_ratio * settings.bond.k_n;
    int lightest = 0;
    packing.radii.minCoeff(&lightest);
    steps.dem = with_spring(steps.dem, k / (density * packing.volume(lightest)));
  }
  if (mode == Mode::dem)
  {
    steps.elastic = steps.dem;
    return steps;
  }

  if (settings.constraint == ConstraintMethod::penalty_mass_scaled && settings.penalty_ratio >= 2.)
    throw InputError(settings.directory + "/case.prm: Coupling/Penalty ratio = " + std::to_string(settings.penalty_ratio) +
                     " is unstable at any time step with Coupling/Method = penalty_mass_scaled, give less than 2 "
                     "(0.25 is safe)");
  if (settings.constraint == ConstraintMethod::multipliers_diagonal && settings.penalty_ratio >= 2.)
    throw InputError(settings.directory + "/case.prm: Coupling/Penalty ratio = " + std::to_string(settings.penalty_ratio) +
                     " is unstable at any time step with Coupling/Method = multipliers_diagonal, give less than 2");
  constexpr double finest = 1.5; // diameters
  if (settings.constraint == ConstraintMethod::multipliers && smallest_edge(fem.mesh()) < finest * packing.mean_diameter)
    throw InputError(settings.directory + "/case.prm: Mesh/Cell size: the smallest cells have edges of " +
                     std::to_string(smallest_edge(fem.mesh()) / packing.mean_diameter) +
                     " particle diameters, too few particles for means around nodes; give at least 1.5, or another "
                     "Coupling/Method than multipliers");
  const double sides = std::min(steps.fem, steps.dem);
  const auto solve_overlap = [&](const std::vector<int> &cells, double largest)
  {
    steps.overlap = undamped_share * limit_of_overlap_around(cells, settings, fem, packing, steps.fluctuations, largest, comm);
    if (!(steps.overlap > 0.))
      throw InputError(settings.directory + "/case.prm: Coupling/Penalty ratio = " + std::to_string(settings.penalty_ratio) +
                       " is unstable at any time step in this overlap, give less");
    steps.elastic = std::min(largest, steps.overlap);
  };
  if (const std::vector<int> cells = cells_inside(fem.mesh(), settings.fixed_region); mode == Mode::fixed && !cells.empty())
  {
    solve_overlap(cells, sides);
    return steps;
  }
  // (dt/sides)^2 4 + ties(dt) = 4, by bisection; a weight at the end of the overlap is about d/(2 L_o).
  const double lightest = mean_mass * 0.5 * packing.mean_diameter / std::max(settings.overlap_width, packing.mean_diameter);
  double lower = 0., upper = sides;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (lower + upper), ratio = middle / sides;
    (4. * ratio * ratio + added_by_ties(settings, middle, lightest) <= 4. ? lower : upper) = middle;
  }
  steps.elastic = lower;
  if (settings.constraint == ConstraintMethod::penalty)
    // The lightest particle that comes to lie at the end of an overlap decides. An overlap in the middle stands for those to
    // come.
    solve_overlap(cells_in_the_middle(fem.mesh(), settings.overlap_width), lower);
  return steps;
}

/// Local damping takes a share of the force against the velocity. A motion that turns back in every step moves against its
/// springs: there it adds that share to their stiffness, and to omega^2.
double stiffened_by_damping(const Case &settings)
{
  return 1. + settings.local_damping;
}
} // namespace

StableSteps stable_steps(const Case &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing, MPI_Comm comm)
{
  StableSteps steps = elastic_steps(settings, mode, fem, packing, comm);
  steps.coupled = mode == Mode::fem ? steps.elastic : steps.elastic / std::sqrt(stiffened_by_damping(settings));
  return steps;
}

void StabilityMonitor::check(const fem::FemSide &fem, const Overlap &overlap, const std::vector<TiedParticle> &tied,
                             const std::vector<char> &active, const std::vector<int> &cells, double dt, Corrector *corrector)
{
  // Values come from below. Six products, from the mode of the event before, have not given less than 0.7 of what 200 give
  // (2D and 3D cuts, penalty and multipliers): far below the limit no second look is needed.
  constexpr int few = 6, many = 30;
  constexpr double limit = 4., near = 0.5 * limit;
  auto now =
    std::make_unique<CoupledOperator>(settings, fem, packing, overlap, tied, active,
                                      surroundings(fem.mesh(), cells, reach_around(settings, overlap)), comm, corrector);
  if (last)
    now->take_mode(*last);
  double highest = now->highest(dt, 1e-2, few);
  if (highest > near)
    highest = now->highest(dt, 1e-2, many);
  last = std::move(now);
  // Without local damping: at worst that keeps a motion alive, springs beyond their limit run away.
  if (highest > limit)
  {
    const double stable = last->stable_step(dt);
    std::ostringstream text;
    text << "the coupled model is unstable at the time step " << dt << " s: the stable step around the cells converted last is "
         << stable << " s; lower Time/Safety or Coupling/Penalty ratio";
    throw UnstableRun(text.str());
  }
}
} // namespace kerf
