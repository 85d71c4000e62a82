// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/nodal_space.h"

#include "fem_side/mesh/discretisation.h"
#include "fem_side/mesh/mesh_builder.h"
#include "fem_side/mesh/periodic_nodes.h"

#include <deal.II/base/partitioner.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/lac/affine_constraints.h>

#include <functional>
#include <stdexcept>
#include <unordered_map>

namespace kerf::fem
{
template <int dim>
Discretisation<dim>::Discretisation(MPI_Comm comm, const MeshSettings &settings)
  : triangulation(build_triangulation<dim>(comm, settings)), element(dealii::FE_Q<dim>(1), dim), dof_handler(*triangulation)
{
}

template <int dim>
NodalSpace<dim>::NodalSpace(MPI_Comm comm, const MeshSettings &settings)
  : comm(comm), discretisation(std::make_unique<Discretisation<dim>>(comm, settings))
{
  fill_mesh();
  find_neighbours();
  const std::vector<int> images = join_periodic_sides<dim>(settings.periodic, mesh);
  discretisation->dof_handler.distribute_dofs(discretisation->element);
  number_nodes();
  find_slaves(images);
  make_exchange();
  number_locally();
}

template <int dim>
NodalSpace<dim>::~NodalSpace() = default;

template <int dim>
void NodalSpace<dim>::fill_mesh()
{
  const auto &triangulation = *discretisation->triangulation;
  mesh.dim = dim;
  mesh.nodes = Eigen::Matrix3Xd::Zero(3, triangulation.n_vertices());
  for (int i = 0; i < mesh.n_nodes(); ++i)
    for (int d = 0; d < dim; ++d)
      mesh.nodes(d, i) = triangulation.get_vertices()[i][d];
  mesh.cells.resize(n, triangulation.n_active_cells());
  mesh.owner.resize(triangulation.n_active_cells());
  for (const auto &cell : triangulation.active_cell_iterators())
  {
    const int index = cell->active_cell_index();
    mesh.owner[index] = cell->subdomain_id();
    if (cell->is_locally_owned())
      owned_cells.push_back(index);
    for (int a = 0; a < n; ++a)
      mesh.cells(a, index) = cell->vertex_index(a);
    for (const auto face : cell->face_indices())
      if (cell->at_boundary(face))
      {
        BoundaryFace boundary;
        boundary.id = cell->face(face)->boundary_id();
        boundary.cell = index;
        for (int a = 0; a < n / 2; ++a)
          boundary.nodes[a] = cell->face(face)->vertex_index(a);
        mesh.boundary.push_back(boundary);
      }
  }
}

template <int dim>
void NodalSpace<dim>::find_neighbours()
{
  mesh.neighbours.resize(mesh.n_cells());
  for (const auto &cell : discretisation->triangulation->active_cell_iterators())
  {
    std::vector<int> &neighbours = mesh.neighbours[cell->active_cell_index()];
    for (const auto face : cell->face_indices())
      if (cell->at_boundary(face))
        continue;
      else if (cell->neighbor(face)->is_active())
        neighbours.push_back(cell->neighbor(face)->active_cell_index());
      else
        for (unsigned int part = 0; part < cell->face(face)->n_children(); ++part)
          neighbours.push_back(cell->neighbor_child_on_subface(face, part)->active_cell_index());
  }
}

template <int dim>
void NodalSpace<dim>::number_nodes()
{
  first_dofs.assign(mesh.n_nodes(), dealii::numbers::invalid_dof_index);
  for (const auto &cell : discretisation->dof_handler.active_cell_iterators())
    for (int a = 0; a < n; ++a)
    {
      first_dofs[cell->vertex_index(a)] = cell->vertex_dof_index(a, 0);
      for (int c = 1; c < dim; ++c)
        if (cell->vertex_dof_index(a, c) != cell->vertex_dof_index(a, 0) + c)
          throw std::logic_error("nodal_space: the components of a node are not numbered consecutively");
    }
}

/// @param images for every node the node of which it is the image across periodic axes, or the node itself
template <int dim>
void NodalSpace<dim>::find_slaves(const std::vector<int> &images)
{
  slave_of.assign(mesh.n_nodes(), -1);
  // By images: of two nodes joined across a periodic axis either may be the hanging one.
  std::unordered_map<int, std::vector<std::pair<int, double>>> hanging;
  if (discretisation->triangulation->has_hanging_nodes())
  {
    dealii::AffineConstraints<double> constraints;
    dealii::DoFTools::make_hanging_node_constraints(discretisation->dof_handler, constraints);
    constraints.close();
    std::unordered_map<dealii::types::global_dof_index, int> node_of;
    for (int node = 0; node < mesh.n_nodes(); ++node)
      node_of[first_dofs[node]] = node;
    for (int node = 0; node < mesh.n_nodes(); ++node)
      if (constraints.is_constrained(first_dofs[node]) && !hanging.count(images[node]))
        for (const auto &[dof, weight] : *constraints.get_constraint_entries(first_dofs[node]))
          hanging[images[node]].emplace_back(node_of.at(dof), weight);
  }
  const std::function<void(SlaveNode &, int, double)> add = [&](SlaveNode &slave, const int node, const double weight)
  {
    const auto found = hanging.find(images[node]);
    if (found != hanging.end())
      for (const auto &[master, share] : found->second)
        add(slave, master, weight * share);
    else
    {
      slave.masters.push_back(images[node]);
      slave.weights.push_back(weight);
    }
  };
  for (int node = 0; node < mesh.n_nodes(); ++node)
    if (images[node] != node || hanging.count(node))
    {
      slave_of[node] = static_cast<int>(mesh.slaves.size());
      mesh.slaves.emplace_back();
      mesh.slaves.back().node = node;
      add(mesh.slaves.back(), node, 1.);
    }
}

template <int dim>
void NodalSpace<dim>::make_exchange()
{
  const auto &dof_handler = discretisation->dof_handler;
  dealii::IndexSet local;
  dealii::DoFTools::extract_locally_active_dofs(dof_handler, local);
  const dealii::IndexSet active = local;
  for (const SlaveNode &slave : mesh.slaves)
    if (active.is_element(first_dofs[slave.node]))
      for (const int master : slave.masters)
        local.add_range(first_dofs[master], first_dofs[master] + dim);
  exchange = std::make_unique<NodalExchange>(
    std::make_shared<const dealii::Utilities::MPI::Partitioner>(dof_handler.locally_owned_dofs(), local, comm));
}

template <int dim>
void NodalSpace<dim>::number_locally()
{
  local_dofs.resize(mesh.n_nodes());
  for (int i = 0; i < mesh.n_nodes(); ++i)
    local_dofs[i] = exchange->has(first_dofs[i]) ? exchange->position(first_dofs[i]) : -1;
  owned_nodes.resize(n_owned_dofs() / dim);
  for (int i = 0; i < mesh.n_nodes(); ++i)
    if (owns(i))
      owned_nodes[local_dof(i) / dim] = i;
  owned_cell_dofs.resize(owned_cells.size());
  for (std::size_t c = 0; c < owned_cells.size(); ++c)
    for (int a = 0; a < n; ++a)
      owned_cell_dofs[c][a] = local_dof(mesh.cells(a, owned_cells[c]));

  for (const SlaveNode &slave : mesh.slaves)
    if (local_dof(slave.node) >= 0)
    {
      LocalSlave local;
      local.dof = local_dof(slave.node);
      for (std::size_t k = 0; k < slave.masters.size(); ++k)
        local.masters.emplace_back(local_dof(slave.masters[k]), slave.weights[k]);
      local_slaves.push_back(local);
    }
}

template <int dim>
void NodalSpace<dim>::update_copies(NodalVector &values) const
{
  double *v = values.data();
  exchange->update_copies(v, v + exchange->n_owned());
  for (const LocalSlave &slave : local_slaves)
    for (int c = 0; c < dim; ++c)
    {
      double value = 0.;
      for (const auto &[master, weight] : slave.masters)
        value += weight * v[master + c];
      v[slave.dof + c] = value;
    }
}

template <int dim>
void NodalSpace<dim>::sum_up(NodalVector &values) const
{
  double *v = values.data();
  for (const LocalSlave &slave : local_slaves)
    for (int c = 0; c < dim; ++c)
    {
      for (const auto &[master, weight] : slave.masters)
        v[master + c] += weight * v[slave.dof + c];
      v[slave.dof + c] = 0.;
    }
  exchange->add_copies(v + exchange->n_owned(), v);
}

template <int dim>
void NodalSpace<dim>::interpolate_slaves(Eigen::Matrix3Xd &values) const
{
  for (const SlaveNode &slave : mesh.slaves)
  {
    values.col(slave.node).setZero();
    for (std::size_t k = 0; k < slave.masters.size(); ++k)
      values.col(slave.node) += slave.weights[k] * values.col(slave.masters[k]);
  }
}

template class NodalSpace<2>;
template class NodalSpace<3>;
} // namespace kerf::fem
