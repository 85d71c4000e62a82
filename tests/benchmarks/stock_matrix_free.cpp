// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/benchmarks/stock_matrix_free.h"

#include "tests/support/fem_fixture.h"

#include <deal.II/dofs/dof_handler.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_system.h>
#include <deal.II/fe/mapping_q1.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_tools.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>
#include <deal.II/lac/la_parallel_vector.h>
#include <deal.II/matrix_free/fe_evaluation.h>
#include <deal.II/matrix_free/matrix_free.h>

namespace kerf::fem::benchmarks
{
using Vector = dealii::LinearAlgebra::distributed::Vector<double>;

template <int dim>
struct StockMatrixFree<dim>::Implementation
{
  using Data = dealii::MatrixFree<dim, double>;

  dealii::Triangulation<dim> triangulation;
  dealii::FESystem<dim> element{dealii::FE_Q<dim>(1), dim};
  dealii::DoFHandler<dim> dof_handler;
  Data data;
  Vector x, y;

  Implementation(const int (&n_cells)[dim], const double distortion)
  {
    std::vector<unsigned int> repetitions(n_cells, n_cells + dim);
    dealii::Point<dim> upper;
    for (int d = 0; d < dim; ++d)
      upper[d] = n_cells[d];
    dealii::GridGenerator::subdivided_hyper_rectangle(triangulation, repetitions, dealii::Point<dim>(), upper);
    if (distortion > 0.)
    {
      std::uint64_t node = 0;
      dealii::GridTools::transform(
        [&](const dealii::Point<dim> &p)
        {
          dealii::Point<dim> moved = p;
          ++node;
          for (int d = 0; d < dim; ++d)
            if (p[d] < 0.5 || p[d] > upper[d] - 0.5)
              return p;
          for (int d = 0; d < dim; ++d)
            moved[d] += distortion * test::noise(3 * node + d);
          return moved;
        },
        triangulation);
    }
    dof_handler.reinit(triangulation);
    dof_handler.distribute_dofs(element);
    dealii::AffineConstraints<double> constraints;
    constraints.close();
    typename Data::AdditionalData options;
    options.mapping_update_flags = dealii::update_gradients | dealii::update_JxW_values;
    options.tasks_parallel_scheme = Data::AdditionalData::none;
    data.reinit(dealii::MappingQ1<dim>(), dof_handler, constraints, dealii::QGauss<1>(2), options);
    data.initialize_dof_vector(x);
    data.initialize_dof_vector(y);
    for (unsigned int i = 0; i < x.locally_owned_size(); ++i)
      x.local_element(i) = 1e-6 * test::noise(i);
  }

  void cell_loop(const Data &data, Vector &y, const Vector &x, const std::pair<unsigned int, unsigned int> &range) const
  {
    const double lambda = test::rock().lame_lambda(), mu = test::rock().lame_mu();
    dealii::FEEvaluation<dim, 1, 2, dim, double> cell(data);
    for (unsigned int batch = range.first; batch < range.second; ++batch)
    {
      cell.reinit(batch);
      cell.gather_evaluate(x, dealii::EvaluationFlags::gradients);
      for (unsigned int q = 0; q < cell.n_q_points; ++q)
      {
        const auto strain = cell.get_symmetric_gradient(q);
        auto stress = (2. * mu) * strain;
        const auto pressure = lambda * trace(strain);
        for (int d = 0; d < dim; ++d)
          stress[d][d] += pressure;
        cell.submit_symmetric_gradient(stress, q);
      }
      cell.integrate_scatter(dealii::EvaluationFlags::gradients, y);
    }
  }
};

template <int dim>
StockMatrixFree<dim>::StockMatrixFree(const int (&n_cells)[dim], const double distortion)
  : implementation(std::make_unique<Implementation>(n_cells, distortion))
{
}

template <int dim>
StockMatrixFree<dim>::~StockMatrixFree() = default;

template <int dim>
int StockMatrixFree<dim>::n_lanes() const
{
  return dealii::VectorizedArray<double>::size();
}

template <int dim>
int StockMatrixFree<dim>::n_cells() const
{
  return implementation->triangulation.n_active_cells();
}

template <int dim>
void StockMatrixFree<dim>::apply()
{
  implementation->data.cell_loop(&Implementation::cell_loop, implementation.get(), implementation->y, implementation->x, true);
}

template class StockMatrixFree<2>;
template class StockMatrixFree<3>;
} // namespace kerf::fem::benchmarks
