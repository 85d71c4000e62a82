// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/stability/stable_step.h"

#include "coupler/base/errors.h"
#include "coupler/base/mesh_geometry.h"
#include "coupler/loading/boundary/particle_boundary.h"
#include "coupler/loading/tool/tool.h"
#include "dem_side/bond/bond_kinematics.h"
#include "dem_side/bond_network/bond_network.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace kerf
{
namespace
{
/// Stable step after a spring is added to a system: omega^2 is at most the sum of both.
double with_spring(double step, double omega2)
{
  return 2. / std::sqrt(4. / (step * step) + omega2);
}

/// Factor by which contact damping of a pair of mean particles reduces the step that Time/Safety is measured by. The damping of
/// a pair is a fraction xi of critical. The highest mode of the packing involves more contacts, so xi_max = xi omega_max
/// sqrt(m/(2 k_n)). The limit with damping is (2/omega) (sqrt(1 + xi^2) - xi). Theory (8.6), (8.7).
double left_by_damping(const ModelSettings &settings, double omega, double mean_mass)
{
  const double xi = settings.bond.damping * omega * std::sqrt(mean_mass / (2. * settings.bond.k_n));
  return std::sqrt(1. + xi * xi) - xi;
}

/// Stable step while the tool is in contact with the mesh. The contact adds 2 k_s/(rho h) to omega^2 of a surface node with
/// area a and lumped mass rho a h/2, for cells of any shape.
double with_tool_on_surface(const double step, const ModelSettings &settings, const fem::Mesh &mesh)
{
  if (!settings.tool.present())
    return step;
  const double k = surface_stiffness(settings.tool, mesh.dim, settings.bond.k_n, settings.mean_diameter);
  return with_spring(step, 2. * k / (settings.body.material.density * smallest_edge(mesh)));
}

double smallest_volume(const dem::Packing &packing)
{
  int smallest = 0;
  packing.radii.minCoeff(&smallest);
  return packing.volume(smallest);
}

std::vector<char> particles_of(const Overlap &overlap, int n)
{
  std::vector<char> active(n);
  for (int i = 0; i < n; ++i)
    active[i] = overlap.needs_particle(i);
  return active;
}

/// The coupled model with some cells converted.
class ModelOfOverlap
{
public:
  ModelOfOverlap(const std::vector<int> &cells, const ModelSettings &settings, fem::FemSide &fem, const dem::Packing &packing,
                 Constraint &constraint, MPI_Comm comm)
    : cells(cells), settings(settings), fem(fem), packing(packing), constraint(constraint), comm(comm)
  {
  }
  /// Largest step [s] at which lambda_max is @p limit; 0: there is none. @param damping of the bonds, fraction of critical [-]
  double largest_step(double damping, double limit, double guess)
  {
    Overlap overlap(fem.mesh(), fem.quadrature_points(), fem.surface_positions(), packing, settings.overlap.weight_function,
                    settings.overlap.width);
    overlap.convert(cells);
    fem.set_weights(overlap.fe_weights(), overlap.fe_surface_weights());
    const ParticleBoundary boundary(fem.mesh(), settings.body.material, settings.body.boundary_conditions, packing,
                                    settings.body.surface_spacing);
    dem::NetworkOperator::Material bonds = bond_material(settings, packing);
    bonds.damping = damping;
    CoupledOperator model(bonds, constraint, fem, packing, overlap, boundary.movable(overlap.tied_particles()),
                          particles_of(overlap, packing.size()),
                          part_around(fem.mesh(), cells, reach_of_overlap(settings, constraint)), comm);
    const double step = model.stable_step(guess, limit);
    fem.set_weights(Eigen::VectorXd::Ones(fem.quadrature_points().cols()),
                    Eigen::VectorXd::Ones(fem.surface_positions().cols()));
    return step;
  }

private:
  const std::vector<int> cells;
  const ModelSettings &settings;
  fem::FemSide &fem;
  const dem::Packing &packing;
  Constraint &constraint;
  MPI_Comm comm;
};

/// Cells in the middle of the mesh, so that the overlap surrounds them.
std::vector<int> cells_in_the_middle(const fem::Mesh &mesh, double reach)
{
  const Eigen::Vector3d lower = mesh.nodes.rowwise().minCoeff(), upper = mesh.nodes.rowwise().maxCoeff();
  Eigen::Vector3d middle = cell_centre(mesh, 0); // centre of the nearest cell, since the mesh may have a hole there
  const auto distance = [&](const Eigen::Vector3d &place) { return (place - 0.5 * (lower + upper)).norm(); };
  for (int cell = 1; cell < mesh.n_cells(); ++cell)
    if (const Eigen::Vector3d centre = cell_centre(mesh, cell); distance(centre) < distance(middle))
      middle = centre;
  return cells_inside(mesh, {Box{middle.array() - reach, middle.array() + reach}});
}

} // namespace

double smallest_edge(const fem::Mesh &mesh)
{
  double smallest = 1e300;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int c = 0; c < mesh.dim; ++c) // lexicographic order: edges join corner 0 to corners 1, 2 and 4
      smallest = std::min(smallest, (mesh.nodes.col(mesh.cells(1 << c, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return smallest;
}

dem::NetworkOperator::Material bond_material(const ModelSettings &settings, const dem::Packing &packing)
{
  return {settings.bond.k_n, settings.bond.k_t, packing.particle_density(settings.body.material.density),
          settings.bond.damping};
}

namespace
{
/// All pairs that touch in compressed rock.
dem::Packing pressed_together(const dem::Packing &packing)
{
  constexpr double pressed = 0.5; // gap / mean radius of pairs that come into contact
  dem::Packing contacts = packing;
  dem::bond_by_gap(contacts, std::max(pressed, packing.gap_tolerance));
  return contacts;
}
} // namespace

double particle_frequency(const dem::Packing &packing, double k_n, double k_t, double density)
{
  const dem::Packing contacts = pressed_together(packing);
  const double whole = dem::largest_frequency(packing, k_n, k_t, density);
  return contacts.bonds == packing.bonds ? whole : std::max(whole, dem::largest_frequency(contacts, k_n, k_t, density));
}

namespace
{
double mean_mass_of(const dem::Packing &packing, double density)
{
  double mean = 0.;
  for (int i = 0; i < packing.size(); ++i)
    mean += density * packing.volume(i) / packing.size();
  return mean;
}

/// What an overlap that is not known before the run adds to lambda_max at most. The weight of the lightest particle is about
/// d/(2 L_o). Theory (8.10).
double of_unknown_overlap(double dt, const ModelSettings &settings, const dem::Packing &packing, double mean_mass,
                          const Constraint &constraint)
{
  const double lightest = mean_mass * 0.5 * packing.mean_diameter / std::max(settings.overlap.width, packing.mean_diameter);
  return constraint.bound_of_added_omega2(dt, lightest);
}

/// The step that Time/Safety is measured by. Theory (8.6) - (8.10).
StableSteps reference_steps(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                            Constraint &constraint, std::unique_ptr<ModelOfOverlap> &overlap, MPI_Comm comm)
{
  StableSteps steps;
  steps.fem = with_tool_on_surface(fem.stable_step(), settings, fem.mesh());
  if (mode == Mode::fem)
  {
    steps.dem = std::numeric_limits<double>::infinity();
    steps.reference = steps.fem;
    return steps;
  }
  const double density = packing.particle_density(settings.body.material.density);
  const double omega = particle_frequency(packing, settings.bond.k_n, settings.bond.k_t, density);
  const double mean_mass = mean_mass_of(packing, density);
  const double undamped_share = left_by_damping(settings, omega, mean_mass);
  steps.dem = 2. / omega * undamped_share;

  if (settings.tool.present())
  {
    // The contact with the tool adds at most k/m of the lightest particle to omega^2.
    const double k = settings.tool.stiffness_ratio * settings.bond.k_n;
    steps.dem = with_spring(steps.dem, k / (density * smallest_volume(packing)));
  }
  if (mode == Mode::dem)
  {
    steps.reference = steps.dem;
    return steps;
  }

  steps.refusal = constraint.refusal(smallest_edge(fem.mesh()) / packing.mean_diameter);
  if (steps.refusal != Refusal::none)
    return steps;
  const double sides = std::min(steps.fem, steps.dem);
  const auto solve_overlap = [&](const std::vector<int> &cells, double largest)
  {
    overlap = std::make_unique<ModelOfOverlap>(cells, settings, fem, packing, constraint, comm);
    const double limit = undamped_share * overlap->largest_step(0., 4., largest);
    if (!(limit > 0.))
      steps.refusal = Refusal::unstable_overlap;
    steps.reference = std::min(largest, limit);
  };
  if (const std::vector<int> cells = cells_inside(fem.mesh(), settings.fixed_region); mode == Mode::fixed && !cells.empty())
  {
    solve_overlap(cells, sides);
    return steps;
  }
  // Solve 4 (dt/sides)^2 + bound(dt) = 4 by bisection.
  double lower = 0., upper = sides;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (lower + upper), ratio = middle / sides;
    const double added = of_unknown_overlap(middle, settings, packing, mean_mass, constraint);
    (4. * ratio * ratio + added <= 4. ? lower : upper) = middle;
  }
  steps.reference = lower;
  if (constraint.depends_on_overlap())
    // The lightest particle at the end of an overlap governs. An overlap in the middle represents the later ones.
    solve_overlap(cells_in_the_middle(fem.mesh(), settings.overlap.width), lower);
  return steps;
}

/// What the contact with a tool adds to lambda_max at most: spring and dashpot along the normal, and the tangential dashpot,
/// which also turns the particle. Theory (8.8), (8.9), (8.14).
struct ShareOfTool
{
  double omega2 = 0.;     ///< of the spring [1/s^2]
  double normal = 0.;     ///< of the dashpots, c/m [1/s]
  double tangential = 0.; ///< with the rotation [1/s]
  double fixed = 0.;      ///< of a contact that follows the step

  double operator()(double dt) const { return fixed + std::max(dt * dt * omega2 + 2. * dt * normal, 2. * dt * tangential); }
};

ShareOfTool on_particles(const ModelSettings &settings, const dem::Packing &packing)
{
  ShareOfTool share;
  const ToolSettings &tool = settings.tool;
  if (!tool.present())
    return share;
  if (tool.stiffness_ratio == 0.)
  {
    share.fixed = contact_share_of_step;
    return share;
  }
  const double lightest = packing.particle_density(settings.body.material.density) * smallest_volume(packing);
  share.omega2 = tool.stiffness_ratio * settings.bond.k_n / lightest;
  share.normal = 2. * tool.damping * std::sqrt(share.omega2);
  share.tangential = tool.friction > 0. ? share.normal * (1. + 1. / dem::inertia_factor(packing.dim)) : 0.;
  return share;
}

ShareOfTool on_surface(const ModelSettings &settings, const fem::Mesh &mesh)
{
  ShareOfTool share;
  const ToolSettings &tool = settings.tool;
  if (!tool.present())
    return share;
  if (tool.stiffness_ratio == 0.)
  {
    share.fixed = contact_share_of_step;
    return share;
  }
  const double k = surface_stiffness(tool, mesh.dim, settings.bond.k_n, settings.mean_diameter);
  const double density = settings.body.material.density, mass = 0.5 * density * smallest_edge(mesh); // per area
  share.omega2 = k / mass;
  share.normal = surface_damping(tool, k, density, settings.mean_diameter) / mass;
  return share;
}

/// Dashpots of absorbing sides on particles [N s/m].
Eigen::VectorXd absorbing_dashpots(const ModelSettings &settings, const fem::Mesh &mesh, const dem::Packing &packing)
{
  const ParticleBoundary boundary(mesh, settings.body.material, settings.body.boundary_conditions, packing,
                                  settings.body.surface_spacing);
  Eigen::VectorXd c = Eigen::VectorXd::Zero(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    for (const ParticleBoundary::Dashpot &dashpot : boundary.role(i).dashpots)
      c[i] += dashpot.area * boundary.impedance_p();
  return (c.array() > 0.).any() ? c : Eigen::VectorXd();
}

/// Largest step at which 4 (dt/stable)^2 is not above the limit.
double largest_step(double stable, const std::function<double(double)> &limit)
{
  double lower = 0., upper = stable;
  for (int k = 0; k < 60; ++k)
  {
    const double middle = 0.5 * (lower + upper), ratio = middle / stable;
    (4. * ratio * ratio <= limit(middle) ? lower : upper) = middle;
  }
  return lower;
}
} // namespace

StableSteps stable_steps(const ModelSettings &settings, Mode mode, fem::FemSide &fem, const dem::Packing &packing,
                         Constraint &constraint, MPI_Comm comm)
{
  std::unique_ptr<ModelOfOverlap> overlap;
  StableSteps steps = reference_steps(settings, mode, fem, packing, constraint, overlap, comm);
  if (steps.refusal != Refusal::none)
    return steps;
  // Local damping is a share of the force against the velocity. A motion that reverses in every step moves against its springs
  // and dashpots, so it adds this share to them. Theory (8.11).
  const double whole = mode == Mode::fem ? 4. : 4. / (1. + settings.local_damping);
  const dem::NetworkOperator::Material bonds = bond_material(settings, packing);
  const double mean_mass = mean_mass_of(packing, bonds.density);
  // Tied particles and nodes are inside of the rock, where no tool is.
  const auto left_by = [&](const ShareOfTool &tool)
  {
    return [&, tool](double dt)
    {
      const double tie = mode == Mode::adaptive ? of_unknown_overlap(dt, settings, packing, mean_mass, constraint) : 0.;
      return whole - std::max(tool(dt), tie);
    };
  };
  steps.coupled = std::numeric_limits<double>::infinity();
  const auto lower_to = [&steps](double step) { steps.coupled = std::min(steps.coupled, step); };
  if (mode != Mode::dem)
    lower_to(largest_step(fem.stable_step(), left_by(on_surface(settings, fem.mesh()))));
  if (mode == Mode::fem)
    return steps;
  const Eigen::VectorXd dashpots = absorbing_dashpots(settings, fem.mesh(), packing);
  lower_to(dem::largest_step(packing, bonds, dashpots, left_by(on_particles(settings, packing))));
  // A particle that the tool touches has no neighbours where the tool is, so pressed rock has the whole limit.
  lower_to(dem::largest_step(pressed_together(packing), bonds, dashpots, [whole](double) { return whole; }));
  if (overlap)
    lower_to(steps.overlap = overlap->largest_step(settings.bond.damping, whole, steps.coupled));
  if (!(steps.coupled > 0.))
    steps.refusal = Refusal::too_much_damping;
  return steps;
}
} // namespace kerf
