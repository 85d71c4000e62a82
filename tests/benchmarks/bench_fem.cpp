// SPDX-License-Identifier: GPL-2.0-or-later
// Cells a second of the continuum's internal forces, of a plain hand-batched loop and of deal.II's own matrix-free evaluation
// on the same meshes of 100 000 cells: boxes, whose edges are parallel to the axes, and distorted cells. Whole steps of the
// solver ("step") also run under mpirun, in wall time.
#include "fem_side/fem_side.h"
#include "tests/benchmarks/plain_cell_loop.h"
#include "tests/benchmarks/stock_matrix_free.h"

#include <benchmark/benchmark.h>
#include <memory>
#include <string>

using namespace kerf::fem;
using namespace kerf::fem::benchmarks;

namespace
{
int n_ranks = 1, rank = 0;
constexpr double distortion = 0.15; ///< of the cell size

template <int dim>
using Extent = int[dim];
constexpr Extent<2> plane = {400, 250};
constexpr Extent<3> solid = {50, 50, 40};
template <int dim>
constexpr const int (&extent())[dim]
{
  if constexpr (dim == 2)
    return plane;
  else
    return solid;
}

const char *name_of(const Strain strain)
{
  return strain == Strain::finite ? "finite" : "small";
}
const char *name_of(const Integration integration)
{
  return integration == Integration::full ? "full" : integration == Integration::selective ? "selective" : "one_point";
}

/// Runs @p apply some times a round and reports cells a second. Switched-off cells count as cells. The number of rounds is
/// fixed: ranks must agree.
template <typename Apply>
void measure(benchmark::State &state, const int n_cells, const Apply &apply)
{
  apply(); // caches, first touch
  constexpr int n_applications = 4;
  for (auto _ : state)
    for (int i = 0; i < n_applications; ++i)
      apply();
  const double done = static_cast<double>(state.iterations()) * n_applications;
  state.counters["cells_per_second"] = benchmark::Counter(done * n_cells, benchmark::Counter::kIsRate);
  state.counters["cells"] = n_cells;
  state.counters["ranks"] = n_ranks;
}

/// Meshes are made when they are needed and kept for the next benchmark.
template <int dim>
const test::CellMesh<dim> &mesh_of(const bool distorted)
{
  static std::unique_ptr<test::CellMesh<dim>> meshes[2];
  auto &mesh = meshes[distorted ? 1 : 0];
  if (!mesh)
  {
    mesh = std::make_unique<test::CellMesh<dim>>(Eigen::Map<const typename test::CellMesh<dim>::Index>(extent<dim>()),
                                                 q1::Point<dim>::Ones());
    if (distorted)
      mesh->distort(distortion);
  }
  return *mesh;
}

enum class Weights
{
  ones,
  uneven, ///< from point to point in every cell
  half    ///< one half of the body is switched off
};

template <int dim>
void forces(benchmark::State &state, const bool distorted, const Strain strain, const Integration integration,
            const Weights weights)
{
  test::CellMesh<dim> mesh = mesh_of<dim>(distorted);
  const auto n_cells = static_cast<int>(mesh.cells.size());
  if (weights == Weights::uneven)
    mesh.uneven_weights();
  if (weights == Weights::half)
  {
    mesh.cells.resize(n_cells / 2);
    mesh.alpha.resize(n_cells / 2);
  }
  const CellKernel<dim> kernel = mesh.kernel(strain, integration);
  const typename test::CellMesh<dim>::Nodal u = mesh.noise(1e-6, 1);
  typename test::CellMesh<dim>::Nodal f = 0. * u;
  measure(state, n_cells, [&] { kernel.subtract_internal_forces(u.data(), f.data()); });
}

template <int dim>
void plain(benchmark::State &state, const bool distorted)
{
  const test::CellMesh<dim> &mesh = mesh_of<dim>(distorted);
  const PlainCellLoop<dim> loop(mesh, !distorted);
  const typename test::CellMesh<dim>::Nodal u = mesh.noise(1e-6, 1);
  typename test::CellMesh<dim>::Nodal f = 0. * u;
  measure(state, static_cast<int>(mesh.cells.size()), [&] { loop.subtract_forces(u.data(), f.data()); });
}

template <int dim>
void stock(benchmark::State &state, const bool distorted)
{
  StockMatrixFree<dim> matrix_free(extent<dim>(), distorted ? distortion : 0.);
  measure(state, matrix_free.n_cells(), [&] { matrix_free.apply(); });
  state.counters["lanes"] = matrix_free.n_lanes();
}

/// Whole steps of the solver.
template <int dim>
void step(benchmark::State &state, const Strain strain, const Integration integration)
{
  Eigen::Vector3d upper = Eigen::Vector3d::Zero();
  for (int d = 0; d < dim; ++d)
    upper[d] = extent<dim>()[d];
  Settings settings = test::box(upper, 1.);
  settings.strain = strain;
  settings.integration = integration;
  const auto side = make_fem_side(settings);
  const int n_nodes = side->mesh().n_nodes();
  side->set_state(test::noise_field(n_nodes, 1e-6, 1, dim), Eigen::Matrix3Xd::Zero(3, n_nodes));
  measure(state, side->mesh().n_cells(), [&] { test::step(*side, 1e-6, 0.); });
}

template <typename Function>
void add(const std::string &name, const Function &function)
{
  auto *bench = benchmark::RegisterBenchmark(name.c_str(), function);
  bench->Iterations(10)->Unit(benchmark::kMillisecond);
  if (n_ranks > 1)
    bench->UseRealTime();
}

template <int dim>
void add_all(const std::string &dimension)
{
  for (const bool distorted : {false, true})
  {
    const std::string mesh = dimension + (distorted ? "_distorted" : "_boxes");
    if (n_ranks > 1)
      break;
    add("plain_loop/" + mesh, [=](benchmark::State &state) { plain<dim>(state, distorted); });
    add("stock_deal_ii/" + mesh, [=](benchmark::State &state) { stock<dim>(state, distorted); });
    for (const Strain strain : {Strain::small, Strain::finite})
      for (const Integration integration : {Integration::full, Integration::selective, Integration::one_point})
        for (const Weights weights : {Weights::ones, Weights::uneven, Weights::half})
        {
          if (weights != Weights::ones && (strain == Strain::finite || integration != Integration::full))
            continue;
          const std::string suffix = weights == Weights::ones ? "" : weights == Weights::uneven ? "/uneven" : "/half";
          add("forces/" + mesh + "/" + name_of(strain) + "/" + name_of(integration) + suffix,
              [=](benchmark::State &state) { forces<dim>(state, distorted, strain, integration, weights); });
        }
  }
  for (const Integration integration : {Integration::full, Integration::one_point})
    add("step/" + dimension + "_boxes/finite/" + name_of(integration),
        [=](benchmark::State &state) { step<dim>(state, Strain::finite, integration); });
}

struct SilentReporter : benchmark::BenchmarkReporter
{
  bool ReportContext(const Context &) override { return true; }
  void ReportRuns(const std::vector<Run> &) override {}
};
} // namespace

int main(int argc, char **argv)
{
  MPI_Init(&argc, &argv);
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  MPI_Comm_rank(MPI_COMM_WORLD, &rank);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv))
    return 2;
  add_all<2>("2d");
  add_all<3>("3d");
  if (rank == 0)
    benchmark::RunSpecifiedBenchmarks();
  else
  {
    SilentReporter silent;
    benchmark::RunSpecifiedBenchmarks(&silent);
  }
  benchmark::Shutdown();
  MPI_Finalize();
  return 0;
}
