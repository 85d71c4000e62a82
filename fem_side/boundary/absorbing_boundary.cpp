// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/boundary/absorbing_boundary.h"

#include <Eigen/Dense>
#include <algorithm>
#include <set>

namespace kerf::fem
{
template <int dim>
AbsorbingBoundary<dim>::AbsorbingBoundary(const Mesh &mesh, const Material &material,
                                          const std::vector<BoundaryCondition> &conditions)
  : material(material), absorbs(mesh.boundary.size(), 0)
{
  for (const BoundaryCondition &condition : conditions)
    if (condition.kind == BoundaryKind::absorbing)
    {
      any = true;
      const std::vector<char> selected = selected_faces(mesh, condition);
      for (std::size_t f = 0; f < selected.size(); ++f)
        absorbs[f] = absorbs[f] || selected[f];
    }
}

template <int dim>
void AbsorbingBoundary<dim>::assemble(const NodalSpace<dim> &space, const Surface<dim> &surface,
                                      const std::vector<PrescribedDof> &prescribed, const NodalVector &mass)
{
  dashpots.clear();
  if (!any)
    return;
  std::array<NodalVector, dim> rows;
  for (NodalVector &row : rows)
    row = space.zero_vector();
  const double normal_impedance = material.density * material.speed_p();
  const double tangential_impedance = material.density * material.speed_s();
  for (const SurfaceFace<dim> &face : surface.all_faces())
  {
    if (!absorbs[face.number])
      continue;
    surface.for_each_load_point(face,
                                [&](const auto &N, const double area, const q1::Point<dim> &n)
                                {
                                  const Matrix normal = n * n.transpose();
                                  const Matrix impedance =
                                    normal_impedance * normal + tangential_impedance * (Matrix::Identity() - normal);
                                  for (int a = 0; a < SurfaceFace<dim>::n; ++a)
                                    for (int r = 0; r < dim; ++r)
                                      for (int c = 0; c < dim; ++c)
                                        rows[r][face.dofs[a] + c] += N[a] * area * impedance(r, c);
                                });
  }
  for (NodalVector &row : rows)
    space.sum_up(row);

  std::set<int> held;
  for (const PrescribedDof &dof : prescribed)
    held.insert(dof.dof);
  for (int dof = 0; dof < space.n_owned_dofs(); dof += dim)
  {
    Dashpot dashpot;
    dashpot.dof = dof;
    dashpot.mass = mass[dof];
    for (int r = 0; r < dim; ++r)
      for (int c = 0; c < dim; ++c)
        if (!held.count(dof + r) && !held.count(dof + c))
          dashpot.C(r, c) = rows[r][dof + c];
    if (dashpot.mass > 0. && dashpot.C.squaredNorm() > 0.)
      dashpots.push_back(dashpot);
  }
}

template <int dim>
void AbsorbingBoundary<dim>::begin_step(const double dt, double *v)
{
  for (Dashpot &dashpot : dashpots)
  {
    Eigen::Map<q1::Point<dim>> velocity(v + dashpot.dof);
    dashpot.force = -dashpot.C * velocity;
    velocity += 0.5 * dt / dashpot.mass * dashpot.force;
  }
}

template <int dim>
double AbsorbingBoundary<dim>::energy_of_begin(const double dt, const double *v) const
{
  double energy = 0.;
  for (const Dashpot &dashpot : dashpots)
    energy -= 0.5 * dt * dashpot.force.dot(Eigen::Map<const q1::Point<dim>>(v + dashpot.dof));
  return energy;
}

template <int dim>
void AbsorbingBoundary<dim>::keep_half_step_velocity(const double *v)
{
  for (Dashpot &dashpot : dashpots)
    dashpot.half_step_velocity = Eigen::Map<const q1::Point<dim>>(v + dashpot.dof);
}

template <int dim>
double AbsorbingBoundary<dim>::end_step(const double dt, double *v)
{
  double energy = 0.;
  for (Dashpot &dashpot : dashpots)
  {
    Eigen::Map<q1::Point<dim>> velocity(v + dashpot.dof);
    const Matrix A = dashpot.mass * Matrix::Identity() + 0.5 * dt * dashpot.C;
    velocity = A.inverse() * (dashpot.mass * velocity);
    dashpot.force = -dashpot.C * velocity;
    energy -= 0.5 * dt * dashpot.force.dot(dashpot.half_step_velocity);
  }
  return energy;
}

template <int dim>
double AbsorbingBoundary<dim>::finite_step_energy(const double dt, const double *f) const
{
  double energy = 0.;
  for (const Dashpot &dashpot : dashpots)
  {
    const Eigen::Map<const q1::Point<dim>> others(f + dashpot.dof);
    energy -= 0.125 * dt * dt / dashpot.mass * (dashpot.force.squaredNorm() + 2. * dashpot.force.dot(others));
  }
  return energy;
}

template class AbsorbingBoundary<2>;
template class AbsorbingBoundary<3>;
} // namespace kerf::fem
