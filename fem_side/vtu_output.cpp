// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/vtu_output.h"

#include <deal.II/numerics/data_out.h>

namespace kerf::fem
{
template <int dim>
void write_vtu_file(const NodalSpace<dim> &space, const std::string &path, const VtuContent &content)
{
  dealii::DataOut<dim> output;
  output.set_cell_selection(
    [&content](const typename dealii::Triangulation<dim>::cell_iterator &cell)
    { return cell->is_active() && cell->is_locally_owned() && content.written[cell->active_cell_index()]; });

  const std::vector<dealii::DataComponentInterpretation::DataComponentInterpretation> vector_valued(
    dim, dealii::DataComponentInterpretation::component_is_part_of_vector);
  output.add_data_vector(space.dof_handler, content.displacement, std::vector<std::string>(dim, "displacement"), vector_valued);
  output.add_data_vector(space.dof_handler, content.velocity, std::vector<std::string>(dim, "velocity"), vector_valued);
  for (const auto &[name, values] : content.cell_data)
    output.add_data_vector(values, name, dealii::DataOut<dim>::type_cell_data);
  dealii::DataOutBase::VtkFlags flags;
  flags.compression_level = dealii::DataOutBase::VtkFlags::best_speed; // the default takes seven times as long
  output.set_flags(flags);
  output.build_patches();
  output.write_vtu_in_parallel(path, space.comm);
}

template void write_vtu_file<2>(const NodalSpace<2> &, const std::string &, const VtuContent &);
template void write_vtu_file<3>(const NodalSpace<3> &, const std::string &, const VtuContent &);
} // namespace kerf::fem
