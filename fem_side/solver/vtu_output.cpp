// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/solver/vtu_output.h"

#include "fem_side/mesh/discretisation.h"

#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/numerics/data_out.h>

namespace kerf::fem
{
namespace
{
/// Name and row of the stress components that are not zero by plane strain.
template <int dim>
const std::vector<std::pair<const char *, int>> stress_component;
template <>
const std::vector<std::pair<const char *, int>> stress_component<2> = {{"xx", 0}, {"yy", 1}, {"zz", 2}, {"xy", 5}};
template <>
const std::vector<std::pair<const char *, int>> stress_component<3> = {{"xx", 0}, {"yy", 1}, {"zz", 2},
                                                                       {"yz", 3}, {"xz", 4}, {"xy", 5}};

using LibraryVector = dealii::LinearAlgebra::distributed::Vector<double>;

/// The owned values; the output fetches copies itself.
template <int dim>
LibraryVector library_vector(const NodalSpace<dim> &space, const NodalVector &values)
{
  LibraryVector result(space.owners().library_partitioner());
  std::copy(values.data(), values.data() + space.n_owned_dofs(), result.begin());
  return result;
}

/// The components as vectors with dim components a node, because degrees of freedom exist for such vectors only.
template <int dim>
std::vector<LibraryVector> nodal_vectors(const NodalSpace<dim> &space, const Eigen::Matrix<double, 6, Eigen::Dynamic> &values)
{
  std::vector<NodalVector> vectors(stress_component<dim>.size() / dim, space.zero_vector());
  for (std::size_t k = 0; k < stress_component<dim>.size(); ++k)
    for (std::size_t i = 0; i < space.owned_nodes.size(); ++i)
      vectors[k / dim][dim * i + k % dim] = values(stress_component<dim>[k].second, space.owned_nodes[i]);
  std::vector<LibraryVector> result;
  for (NodalVector &vector : vectors)
  {
    space.update_copies(vector);
    result.push_back(library_vector(space, vector));
  }
  return result;
}
} // namespace

template <int dim>
void write_vtu_file(const NodalSpace<dim> &space, const std::string &path, const VtuContent &content)
{
  const auto &dof_handler = space.library().dof_handler;
  const LibraryVector displacement = library_vector(space, content.displacement);
  const LibraryVector velocity = library_vector(space, content.velocity);
  dealii::DataOut<dim> output;
  output.set_cell_selection(
    [&content](const typename dealii::Triangulation<dim>::cell_iterator &cell)
    { return cell->is_active() && cell->is_locally_owned() && content.written[cell->active_cell_index()]; });

  const std::vector<dealii::DataComponentInterpretation::DataComponentInterpretation> vector_valued(
    dim, dealii::DataComponentInterpretation::component_is_part_of_vector);
  output.add_data_vector(dof_handler, displacement, std::vector<std::string>(dim, "displacement"), vector_valued);
  output.add_data_vector(dof_handler, velocity, std::vector<std::string>(dim, "velocity"), vector_valued);
  const std::vector<LibraryVector> smooth = nodal_vectors(space, content.smooth_stress);
  const std::vector<dealii::DataComponentInterpretation::DataComponentInterpretation> scalars(
    dim, dealii::DataComponentInterpretation::component_is_scalar);
  std::vector<std::string> stresses; // of stresses
  for (std::size_t k = 0; k < smooth.size(); ++k)
  {
    std::vector<std::string> names;
    for (int c = 0; c < dim; ++c)
      names.push_back(std::string("smooth_stress_") + stress_component<dim>[dim * k + c].first);
    output.add_data_vector(dof_handler, smooth[k], names, scalars);
    stresses.insert(stresses.end(), names.begin(), names.end());
  }
  std::vector<dealii::Vector<double>> cell_data; // the output keeps references
  cell_data.reserve(content.cell_data.size());
  for (const auto &[name, values] : content.cell_data)
  {
    cell_data.emplace_back(values.data(), values.data() + values.size());
    output.add_data_vector(cell_data.back(), name, dealii::DataOut<dim>::type_cell_data);
    if (name != "alpha")
      stresses.push_back(name);
  }
  dealii::DataOutBase::VtkFlags flags;
  flags.compression_level = dealii::DataOutBase::VtkFlags::best_speed; // the default takes seven times as long
  flags.physical_units = {{"displacement", "m"}, {"velocity", "m/s"}, {"alpha", "1"}};
  for (const std::string &name : stresses)
    flags.physical_units[name] = "Pa";
  output.set_flags(flags);
  output.build_patches();
  try
  {
    output.write_vtu_in_parallel(path, space.comm);
  }
  catch (const dealii::ExceptionBase &) // its text has many lines; the disk is full or the file may not be written
  {
    throw std::runtime_error(path + ": cannot be written");
  }
}

template void write_vtu_file<2>(const NodalSpace<2> &, const std::string &, const VtuContent &);
template void write_vtu_file<3>(const NodalSpace<3> &, const std::string &, const VtuContent &);
} // namespace kerf::fem
