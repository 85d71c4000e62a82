// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/explicit_solver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
template <int dim>
ExplicitSolver<dim>::ExplicitSolver(const Settings &settings_in)
  : settings(settings_in), space(settings.comm, settings.mesh), locator(space),
    kernel(settings.material, settings.strain, settings.integration),
    prescribed(prescribed_dofs<dim>(space, settings.boundary_conditions)), surface(space, settings.surface_spacing),
    absorbing(space.mesh, settings.material, settings.boundary_conditions),
    loads(space.mesh, settings, initial_state(settings).first_piola)
{
  for (NodalVector *v : {&displacement, &velocity, &force, &mass})
    *v = space.zero_vector();
  compute_cell_points();
  set_weights(Eigen::VectorXd::Ones(points.cols()), Eigen::VectorXd::Ones(surface.all_points().cols()));
  set_window({});
  if (settings.initial_stress.norm() > 0.)
    set_initial_state(initial_state(settings).gradient);
}

template <int dim>
void ExplicitSolver<dim>::set_initial_state(const Eigen::Matrix3d &gradient)
{
  const Eigen::Matrix3Xd &X = space.mesh.nodes;
  Eigen::Vector3d anchor = 0.5 * (X.rowwise().minCoeff() + X.rowwise().maxCoeff());
  anchor[1] = X.row(1).maxCoeff();
  set_state(gradient * (X.colwise() - anchor), Eigen::Matrix3Xd::Zero(3, X.cols()));
}

template <int dim>
void ExplicitSolver<dim>::compute_cell_points()
{
  const std::size_t n_cells = space.owned_cells.size();
  points.setZero(3, n * n_cells);
  centres.resize((n_cells + n_lanes - 1) / n_lanes);
  const Eigen::Matrix<double, n, dim> D = q1::shape_derivatives<dim>(q1::Point<dim>::Zero());
  for (std::size_t c = 0; c < n_cells; ++c)
  {
    const q1::NodalValues<dim> X = space.cell_nodes(space.owned_cells[c]);
    for (int q = 0; q < n; ++q)
      points.col(n * c + q).template head<dim>() = X * q1::shape_values<dim>(q1::gauss_point<dim>(q));
    const Eigen::Matrix<double, n, dim> gradient = D * Eigen::Matrix<double, dim, dim>(X * D).inverse();
    CentreBatch &batch = centres[c / n_lanes];
    for (std::size_t lane = c % n_lanes; lane < (c + 1 == n_cells ? n_lanes : c % n_lanes + 1); ++lane)
      for (int a = 0; a < n; ++a)
      {
        batch.dof[a][lane] = space.owned_cell_dofs[c][a];
        for (int d = 0; d < dim; ++d)
          batch.gradient[a][d][lane] = gradient(a, d);
      }
  }
}

template <int dim>
void ExplicitSolver<dim>::set_weights(const Eigen::VectorXd &weights, const Eigen::VectorXd &surface_weights)
{
  if (weights.size() != points.cols())
    throw std::logic_error("set_weights: not as many weights as quadrature points");
  for (const Eigen::VectorXd *values : {&weights, &surface_weights})
    if (values->size() > 0 && !(values->minCoeff() >= 0. && values->maxCoeff() <= 1. + 1e-12))
      throw std::logic_error("set_weights: weights must lie between 0 and 1");
  alpha = weights;
  build_kernel();
  compute_masses();
  stop_massless_nodes();
  surface.set_weights(surface_weights);
  absorbing.assemble(space, surface, prescribed, mass);
  loads.assemble(space, surface, mass);
  forces_are_current = false;
}

template <int dim>
void ExplicitSolver<dim>::build_kernel()
{
  kernel.clear();
  for (std::size_t c = 0; c < space.owned_cells.size(); ++c)
    if (is_active(c))
      kernel.add_cell(space.owned_cell_dofs[c], space.cell_nodes(space.owned_cells[c]), weights_of(c));
  n_active = kernel.n_cells();
  MPI_Allreduce(MPI_IN_PLACE, &n_active, 1, MPI_INT, MPI_SUM, space.comm);
}

template <int dim>
std::array<double, ExplicitSolver<dim>::n> ExplicitSolver<dim>::weights_of(const int owned_cell) const
{
  std::array<double, n> result;
  for (int q = 0; q < n; ++q)
    result[q] = alpha[n * owned_cell + q];
  return result;
}

template <int dim>
void ExplicitSolver<dim>::compute_masses()
{
  mass.setZero();
  for (std::size_t c = 0; c < space.owned_cells.size(); ++c)
  {
    if (!is_active(c))
      continue;
    const q1::NodalValues<dim> X = space.cell_nodes(space.owned_cells[c]);
    for (int q = 0; q < n; ++q)
    {
      const auto xi = q1::gauss_point<dim>(q);
      const auto N = q1::shape_values<dim>(xi);
      const Eigen::Matrix<double, dim, dim> J = X * q1::shape_derivatives<dim>(xi);
      const double point_mass = alpha[n * c + q] * settings.material.density * J.determinant();
      for (int a = 0; a < n; ++a)
        for (int d = 0; d < dim; ++d)
          mass[space.owned_cell_dofs[c][a] + d] += N[a] * point_mass;
    }
  }
  space.sum_up(mass);

  inverse_mass.resize(space.n_owned_dofs());
  for (int i = 0; i < space.n_owned_dofs(); ++i)
    inverse_mass[i] = mass[i] > 0. ? 1. / mass[i] : 0.;
  for (const PrescribedDof &dof : prescribed)
    inverse_mass[dof.dof] = 0.;
}

template <int dim>
void ExplicitSolver<dim>::stop_massless_nodes()
{
  for (int i = 0; i < space.n_owned_dofs(); ++i)
    if (mass[i] == 0.)
      velocity[i] = 0.;
}

template <int dim>
void ExplicitSolver<dim>::begin_step(const double dt, const double time)
{
  if (!forces_are_current)
    compute_forces();
  double *u = displacement.data(), *v = velocity.data();
  const double *f = force.data();
  const int n_dofs = space.n_owned_dofs();

  boundary_work -= kinetic_energy_of_velocity_boundaries();
  absorbing.begin_step(dt, v);
  for (int i = 0; i < n_dofs; ++i)
    v[i] += 0.5 * dt * inverse_mass[i] * f[i];
  for (const PrescribedDof &dof : prescribed)
  {
    const bool moves = dof.condition && mass[dof.dof] > 0.;
    v[dof.dof] = moves ? dof.condition->velocity_at(time - 0.5 * dt)[dof.component] : 0.;
    boundary_work -= 0.5 * dt * v[dof.dof] * f[dof.dof];
  }
  absorbed_energy += absorbing.energy_of_begin(dt, v);
  boundary_work += 0.5 * dt * loads.power(now, v);
  now = time;
  add_surface_work(dt);
  for (int i = 0; i < n_dofs; ++i)
    u[i] += dt * v[i];
}

template <int dim>
void ExplicitSolver<dim>::compute_forces()
{
  space.update_copies(displacement);
  space.update_copies(velocity); // read by surface_points(), which is not collective
  force.setZero();
  for (std::vector<double> &load : surface_force)
    load.assign(surface.owned_dofs().size(), 0.);
  kernel.subtract_internal_forces(displacement.data(), force.data());
  space.sum_up(force);
  loads.add_forces(now, force.data());
  forces_are_current = true;
}

template <int dim>
void ExplicitSolver<dim>::end_step(const double dt, const double time)
{
  double *v = velocity.data();
  const double *f = force.data();

  // Work of the velocity boundaries: kinetic energy gained by their nodes and work done on the rest (trapezoidal rule).
  for (const PrescribedDof &dof : prescribed)
    boundary_work -= 0.5 * dt * v[dof.dof] * f[dof.dof];
  boundary_work += 0.5 * dt * loads.power(time, v);
  add_surface_work(dt);
  absorbing.keep_half_step_velocity(v);
  for (int i = 0; i < space.n_owned_dofs(); ++i)
    v[i] += 0.5 * dt * inverse_mass[i] * f[i];
  absorbed_energy += absorbing.end_step(dt, v);
  for (const PrescribedDof &dof : prescribed)
  {
    const bool moves = dof.condition && mass[dof.dof] > 0.;
    v[dof.dof] = moves ? dof.condition->velocity_at(time)[dof.component] : 0.;
  }
  boundary_work += kinetic_energy_of_velocity_boundaries();
  last_dt = dt;
}

template <int dim>
void ExplicitSolver<dim>::check_motion() const
{
  NodalVector &u = with_copies;
  u = displacement;
  space.update_copies(u);
  std::array<Eigen::Matrix<double, n, dim>, n> derivatives;
  for (int q = 0; q < n; ++q)
    derivatives[q] = q1::shape_derivatives<dim>(q1::gauss_point<dim>(q));
  const int none = space.mesh.n_cells();
  int not_finite = !velocity.head(space.n_owned_dofs()).allFinite(), inside_out = none;
  for (std::size_t c = 0; c < space.owned_cells.size(); ++c)
  {
    if (!is_active(static_cast<int>(c)))
      continue;
    q1::NodalValues<dim> x = space.cell_nodes(space.owned_cells[c]);
    for (int a = 0; a < n; ++a)
      x.col(a) += Eigen::Map<const q1::Point<dim>>(u.data() + space.owned_cell_dofs[c][a]);
    for (int q = 0; q < n; ++q) // where the stress counts
      if (alpha[n * static_cast<int>(c) + q] > 0. && !(Eigen::Matrix<double, dim, dim>(x * derivatives[q]).determinant() > 0.))
        inside_out = std::min(inside_out, space.owned_cells[c]);
  }
  int worst[] = {-not_finite, inside_out};
  MPI_Allreduce(MPI_IN_PLACE, worst, 2, MPI_INT, MPI_MIN, space.comm);
  if (worst[0] != 0)
    throw Unstable("the velocities of the finite elements are not finite");
  if (worst[1] == none)
    return;
  const q1::Point<dim> centre = space.cell_nodes(worst[1]).rowwise().mean();
  std::ostringstream text;
  text << "cell " << worst[1] << " around (" << centre[0];
  for (int c = 1; c < dim; ++c)
    text << ", " << centre[c];
  text << ") m has turned inside out; its loads are too large for an elastic continuum, or the time step is too large";
  throw Unstable(text.str());
}

template <int dim>
double ExplicitSolver<dim>::finite_step_energy() const
{
  double energy = absorbing.finite_step_energy(last_dt, force.data());
  for (int i = 0; i < space.n_owned_dofs(); ++i)
    energy -= 0.125 * last_dt * last_dt * inverse_mass[i] * force[i] * force[i];
  return energy;
}

template <int dim>
double ExplicitSolver<dim>::kinetic_energy_of_velocity_boundaries() const
{
  double energy = 0.;
  for (const PrescribedDof &dof : prescribed)
  {
    const double v = velocity[dof.dof];
    energy += 0.5 * mass[dof.dof] * v * v;
  }
  return energy;
}

template <int dim>
void ExplicitSolver<dim>::set_window(const std::vector<int> &nodes)
{
  for (const int node : nodes)
  {
    if (node < 0 || node >= space.mesh.n_nodes())
      throw std::logic_error("set_window: the mesh has no node " + std::to_string(node));
    if (space.is_slave(node))
      throw std::logic_error("set_window: node " + std::to_string(node) + " is a slave, ask for its masters");
  }
  nodal_window = std::make_unique<NodalWindow<dim>>(space, nodes);
}

template <int dim>
const double *ExplicitSolver<dim>::owned_values(const NodalField field) const
{
  switch (field)
  {
  case NodalField::displacement:
    return displacement.data();
  case NodalField::velocity:
    return velocity.data();
  case NodalField::force:
    return force.data();
  case NodalField::inverse_mass:
    return inverse_mass.data();
  default:
    return mass.data();
  }
}

template <int dim>
void ExplicitSolver<dim>::read_window(const NodalField field, Eigen::Matrix3Xd &values) const
{
  nodal_window->read(owned_values(field), values);
  if (field == NodalField::mass)
    values.row(2) = values.row(0);
}

template <int dim>
void ExplicitSolver<dim>::add_window_forces(const Eigen::Matrix3Xd &forces)
{
  if (forces.cols() != nodal_window->n_nodes())
    throw std::logic_error("add_window_forces: not as many forces as nodes of the window");
  nodal_window->add(forces, force.data());
}

template <int dim>
void ExplicitSolver<dim>::surface_points(const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, const NearTest &near,
                                         SurfacePoints &found) const
{
  surface.find_points(displacement.data(), velocity.data(), lower, upper, near, found);
}

template <int dim>
void ExplicitSolver<dim>::add_surface_forces(const Eigen::Matrix3Xd &forces, const SurfaceLoad source)
{
  std::vector<double> &load = surface_force[static_cast<int>(source)];
  const std::vector<int> &dofs = surface.owned_dofs();
  for (std::size_t k = 0; k < dofs.size(); ++k)
    load[k] -= force[dofs[k]];
  // Copies are zero since the last sum_up(), so only the new contributions are added to their owners.
  surface.add_forces(forces, force.data());
  space.sum_up(force);
  for (std::size_t k = 0; k < dofs.size(); ++k)
    load[k] += force[dofs[k]];
}

/// Half of the trapezoidal rule: forces of this time level times half of the drift at the present half-step velocity.
template <int dim>
void ExplicitSolver<dim>::add_surface_work(const double dt)
{
  const std::vector<int> &dofs = surface.owned_dofs();
  for (std::size_t source = 0; source < surface_force.size(); ++source)
    for (std::size_t k = 0; k < surface_force[source].size(); ++k)
      surface_work[source] += 0.5 * dt * surface_force[source][k] * velocity[dofs[k]];
}

template <int dim>
void ExplicitSolver<dim>::set_state(const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v)
{
  if (u.cols() != space.mesh.n_nodes() || v.cols() != space.mesh.n_nodes())
    throw std::logic_error("set_state: not as many values as nodes");
  for (std::size_t i = 0; i < space.owned_nodes.size(); ++i)
    for (int c = 0; c < dim; ++c)
    {
      displacement[dim * i + c] = u(c, space.owned_nodes[i]);
      velocity[dim * i + c] = v(c, space.owned_nodes[i]);
    }
  stop_massless_nodes();
  space.update_copies(displacement);
  space.update_copies(velocity);
  forces_are_current = false;
}

template <int dim>
Eigen::Matrix3Xd ExplicitSolver<dim>::gather(const NodalField field) const
{
  const double *values = owned_values(field);
  Eigen::Matrix3Xd result = Eigen::Matrix3Xd::Zero(3, space.mesh.n_nodes());
  for (std::size_t i = 0; i < space.owned_nodes.size(); ++i)
    for (int c = 0; c < dim; ++c)
      result(c, space.owned_nodes[i]) = values[dim * i + c];
  MPI_Allreduce(MPI_IN_PLACE, result.data(), static_cast<int>(result.size()), MPI_DOUBLE, MPI_SUM, space.comm);
  if (field == NodalField::displacement || field == NodalField::velocity)
    space.interpolate_slaves(result);
  if (field == NodalField::mass)
    result.row(2) = result.row(0);
  return result;
}

template <int dim>
Energies ExplicitSolver<dim>::energies() const
{
  NodalVector u = displacement;
  space.update_copies(u);
  double kinetic = 0.;
  for (int i = 0; i < space.n_owned_dofs(); ++i)
    kinetic += 0.5 * mass[i] * velocity[i] * velocity[i];
  std::array<double, 7> sums = {{kinetic, finite_step_energy(), kernel.elastic_energy(u.data()), boundary_work, absorbed_energy,
                                 surface_work[0], surface_work[1]}};
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), sums.size(), MPI_DOUBLE, MPI_SUM, space.comm);
  return {sums[0], sums[1], sums[2], sums[3], sums[4], {{sums[5], sums[6]}}};
}

template class ExplicitSolver<2>;
template class ExplicitSolver<3>;
} // namespace kerf::fem
