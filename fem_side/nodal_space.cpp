// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/nodal_space.h"

#include "fem_side/mesh_builder.h"
#include "fem_side/periodic_nodes.h"

#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>

#include <stdexcept>

namespace kerf::fem
{
template <int dim>
NodalSpace<dim>::NodalSpace(MPI_Comm comm, const MeshSettings &settings)
  : comm(comm), triangulation(build_triangulation<dim>(comm, settings)), element(dealii::FE_Q<dim>(1), dim),
    dof_handler(*triangulation)
{
  fill_mesh();
  join_periodic_sides<dim>(settings.periodic, mesh);
  dof_handler.distribute_dofs(element);
  number_nodes();
}

template <int dim>
void NodalSpace<dim>::fill_mesh()
{
  mesh.dim = dim;
  mesh.nodes = Eigen::Matrix3Xd::Zero(3, triangulation->n_vertices());
  for (int i = 0; i < mesh.n_nodes(); ++i)
    for (int d = 0; d < dim; ++d)
      mesh.nodes(d, i) = triangulation->get_vertices()[i][d];
  mesh.cells.resize(n, triangulation->n_active_cells());
  mesh.owner.resize(triangulation->n_active_cells());
  for (const auto &cell : triangulation->active_cell_iterators())
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
void NodalSpace<dim>::number_nodes()
{
  own_dofs.assign(mesh.n_nodes(), dealii::numbers::invalid_dof_index);
  for (const auto &cell : dof_handler.active_cell_iterators())
    for (int a = 0; a < n; ++a)
    {
      own_dofs[cell->vertex_index(a)] = cell->vertex_dof_index(a, 0);
      for (int c = 1; c < dim; ++c)
        if (cell->vertex_dof_index(a, c) != cell->vertex_dof_index(a, 0) + c)
          throw std::logic_error("the components of a node are not numbered consecutively");
    }

  for (int i = 0; i < mesh.n_nodes(); ++i)
    first_dofs.push_back(own_dofs[mesh.master[i]]);

  dealii::IndexSet needed;
  dealii::DoFTools::extract_locally_active_dofs(dof_handler, needed);
  for (const int cell : owned_cells)
    for (int a = 0; a < n; ++a)
      needed.add_range(first_dof(mesh.cells(a, cell)), first_dof(mesh.cells(a, cell)) + dim);
  partitioner = std::make_shared<Partitioner>(dof_handler.locally_owned_dofs(), needed, comm);

  owned_nodes.resize(partitioner->locally_owned_size() / dim);
  for (int i = 0; i < mesh.n_nodes(); ++i)
    if (partitioner->in_local_range(own_dofs[i]))
      owned_nodes[partitioner->global_to_local(own_dofs[i]) / dim] = i;
  owned_cell_dofs.resize(owned_cells.size());
  for (std::size_t c = 0; c < owned_cells.size(); ++c)
    for (int a = 0; a < n; ++a)
      owned_cell_dofs[c][a] = local_dof(mesh.cells(a, owned_cells[c]));
}

template <int dim>
void NodalSpace<dim>::copy_to_images(NodalVector &vector) const
{
  vector.update_ghost_values();
  for (const int node : owned_nodes)
    if (mesh.master[node] != node)
      for (int c = 0; c < dim; ++c)
        vector.local_element(partitioner->global_to_local(own_dofs[node]) + c) = vector.local_element(local_dof(node) + c);
  vector.update_ghost_values();
}

template class NodalSpace<2>;
template class NodalSpace<3>;
} // namespace kerf::fem
