// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/boundary/external_loads.h"

#include <stdexcept>

namespace kerf::fem
{
namespace
{
/// Rollers let the rock slide along them, so they cannot hold a shear stress.
void check_rollers(const Mesh &mesh, const BoundaryCondition &roller, const Eigen::Matrix3d &first_piola)
{
  constexpr double round_off = 1e-9;
  const std::vector<char> selected = selected_faces(mesh, roller);
  for (std::size_t f = 0; f < selected.size(); ++f)
    if (selected[f])
    {
      const Eigen::Vector3d normal = face_points(mesh, mesh.boundary[f], 0.).area.rowwise().sum().normalized();
      const Eigen::Vector3d traction = first_piola * normal, shear = traction - traction.dot(normal) * normal;
      if (shear.norm() > round_off * first_piola.norm())
        throw std::invalid_argument("boundary condition: roller on " + roller.name() +
                                    ", which cannot hold the shear of the initial stress; give in_situ or fixed there");
    }
}
} // namespace

template <int dim>
ExternalLoads<dim>::ExternalLoads(const Mesh &mesh, const Settings &settings, const Eigen::Matrix3d &first_piola)
{
  for (const BoundaryCondition &condition : settings.boundary_conditions)
    if (condition.kind == BoundaryKind::roller && first_piola.norm() > 0.)
      check_rollers(mesh, condition, first_piola);
  for (const BoundaryCondition &condition : settings.boundary_conditions)
  {
    const bool holds = condition.kind == BoundaryKind::in_situ || condition.kind == BoundaryKind::absorbing;
    if (condition.kind != BoundaryKind::traction && !(holds && first_piola.norm() > 0.))
      continue;
    Load load;
    load.faces = selected_faces(mesh, condition);
    load.ramp = condition.ramp;
    load.held_before_start = holds;
    if (holds)
      load.stress = first_piola.topLeftCorner<dim, dim>();
    else
      load.traction = condition.traction.head<dim>();
    loads.push_back(load);
  }
  if (settings.gravity.norm() > 0.)
  {
    Load load;
    load.traction = settings.gravity.head<dim>();
    load.ramp = settings.gravity_ramp;
    loads.push_back(load);
  }
}

template <int dim>
void ExternalLoads<dim>::assemble(const NodalSpace<dim> &space, const Surface<dim> &surface, const NodalVector &mass)
{
  for (Load &load : loads)
  {
    load.forces.clear();
    if (load.faces.empty())
    {
      for (int dof = 0; dof < space.n_owned_dofs(); ++dof)
        if (mass[dof] > 0. && load.traction[dof % dim] != 0.)
          load.forces.emplace_back(dof, mass[dof] * load.traction[dof % dim]);
      continue;
    }
    NodalVector f = space.zero_vector();
    for (const SurfaceFace<dim> &face : surface.all_faces())
      if (load.faces[face.number])
        surface.for_each_load_point(face,
                                    [&](const auto &N, const double area, const q1::Point<dim> &normal)
                                    {
                                      const q1::Point<dim> force = area * (load.traction + load.stress * normal);
                                      for (int a = 0; a < SurfaceFace<dim>::n; ++a)
                                        for (int c = 0; c < dim; ++c)
                                          f[face.dofs[a] + c] += N[a] * force[c];
                                    });
    space.sum_up(f);
    for (int dof = 0; dof < space.n_owned_dofs(); ++dof)
      if (f[dof] != 0.)
        load.forces.emplace_back(dof, f[dof]);
  }
}

template <int dim>
void ExternalLoads<dim>::add_forces(const double time, double *f) const
{
  for (const Load &load : loads)
  {
    const double factor = load.factor(time);
    for (const auto &[dof, force] : load.forces)
      f[dof] += factor * force;
  }
}

template <int dim>
double ExternalLoads<dim>::power(const double time, const double *v) const
{
  double sum = 0.;
  for (const Load &load : loads)
  {
    double part = 0.;
    for (const auto &[dof, force] : load.forces)
      part += v[dof] * force;
    sum += load.factor(time) * part;
  }
  return sum;
}

template class ExternalLoads<2>;
template class ExternalLoads<3>;
} // namespace kerf::fem
