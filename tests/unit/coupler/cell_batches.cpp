// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/constraint/exchange/cell_batches.h"
#include "tests/support/dummy_particles.h"
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf;
using Eigen::Vector3d;

namespace
{
constexpr double h = 0.1;

/// A box with cells of two sizes: where they meet, some hang.
template <int dim>
std::unique_ptr<fem::FemSide> refined_side()
{
  fem::Settings settings = fem::test::box({4 * h, 3 * h, dim == 3 ? 3 * h : 0.}, h);
  settings.mesh.refined = {{{0., 0., 0.}, {0.15, 0.15, 0.15}, 1}};
  return fem::make_fem_side(settings);
}

/// Scattered in the box, and some on its faces, edges and corners.
template <int dim>
Eigen::Matrix3Xd places()
{
  constexpr int n = 301; // not a multiple of anything that is done at once
  Eigen::Matrix3Xd points = fem::test::noise_field(n, 0.5, 3, dim);
  for (int i = 0; i < n; ++i)
    for (int d = 0; d < dim; ++d)
    {
      const double cells = (d == 0 ? 4. : 3.) * (points(d, i) + 0.5);
      points(d, i) = h * ((i + d) % 7 == 0 ? std::round(2. * cells) / 2. : cells);
    }
  return points;
}

/// Cell by cell and with monomials, entries do what they do one by one with shape functions: both ways, for any field.
template <int dim>
void compare_with_shape_functions()
{
  const auto side = refined_side<dim>();
  dem::Packing packing;
  packing.dim = dim;
  packing.positions = places<dim>();
  const int n = static_cast<int>(packing.positions.cols());
  packing.radii = Eigen::VectorXd::Constant(n, 0.1 * h);
  test::DummyParticles particles(packing.positions);
  std::vector<TiedParticle> tied(n);
  for (int i = 0; i < n; ++i)
    tied[i].index = i;
  ParticleInterpolation interpolation(packing, WindowNodes::own, MPI_COMM_WORLD);
  interpolation.set_particles(tied);
  ASSERT_EQ(interpolation.update(particles.view(), *side), InterpolationChange::renewed);
  CellBatches<dim> cells;
  cells.assign(interpolation, side->mesh(), packing);

  const Eigen::Matrix3Xd field = fem::test::noise_field(interpolation.n_window(), 1., 5, 3);
  Eigen::Matrix3Xd sums = Eigen::Matrix3Xd::Zero(3, interpolation.n_window()), expected = sums;
  using Vectors = PackedVectors<dim>;
  const double along[] = {1., 2., 3.};
  const auto direction = Vectors::load_one(along);
  std::vector<SimdLanes> numbers(interpolation.n_window()),
    given_numbers(interpolation.n_window(), SimdLanes{}); // several of each node
  for (int a = 0; a < interpolation.n_window(); ++a)
    numbers[a] = SimdLanes{field(0, a), field(1, a), field(2, a), 1.};
  const std::vector<SimdLanes> load =
    cells.lanes_of([](std::size_t k) { return fem::test::noise(static_cast<std::uint64_t>(k)); });
  constexpr double round_off = 1e-13; // of a few dozen terms of order one
  int begin = 0, n_seen = 0, n_hanging = 0;
  for (const auto &cell : cells.cells())
  {
    constexpr int corners = CellBatches<dim>::corners;
    SimdPack packed[corners], packed_places[corners], scaled_places[corners], given[corners] = {};
    typename Vectors::One present[corners];
    SimdLanes of_numbers[corners], moments[corners] = {};
    cells.places(cell, field, present);
    cells.coefficients_of(cell, numbers, of_numbers);
    cells.places(cell, field, scaled_places, 3.);
    cells.coefficients(cell, field, packed);
    cells.places(cell, field, packed_places);
    for (int k = begin; k < cell.end; ++k)
    {
      const auto &batch = cells.batches()[k];
      for (int l = 0; l < n_simd_lanes; ++l)
      {
        if (!cells.is_used(k, l))
          continue;
        ++n_seen;
        n_hanging += cell.hanging >= 0;
        const InterpolatedParticle &entry = interpolation.entries()[cells.entry(k, l)];
        Vector3d value = Vector3d::Zero();
        for (int a = 0; a < entry.n; ++a)
          value += entry.N[a] * field.col(entry.node[a]);
        const auto xi = batch.place(l / Vectors::n_entries);
        std::array<SimdLanes, dim> here;
        std::array<typename Vectors::One, dim> one_here;
        for (int d = 0; d < dim; ++d)
        {
          here[d] = SimdLanes{} + batch.xi[d][l];
          one_here[d] = typename Vectors::One{} + batch.xi[d][l];
        }
        add_moments(SimdLanes(load[k][l] * SimdLanes{1., 2., 3., 4.}), here, moments);
        for (int c = 0; c < dim; ++c)
        {
          const int in_pack = Vectors::components * (l % Vectors::n_entries) + c;
          EXPECT_NEAR(value_of(of_numbers, here)[c], value[c], round_off);
          EXPECT_NEAR(value_of(present, one_here)[c], entry.origin[c] + value[c], round_off);
          EXPECT_NEAR(value_of(scaled_places, xi)[in_pack], 3. * entry.origin[c] + value[c], round_off);
          EXPECT_NEAR(value_of(packed, xi)[in_pack], value[c], round_off);
          EXPECT_NEAR(value_of(packed_places, xi)[in_pack], entry.origin[c] + value[c], round_off);
        }
        ParticleInterpolation::spread(entry, load[k][l] * Vector3d(1., 2., 3.), expected);
      }
      for (int p = 0; p < n_packs<dim>; ++p)
        add_moments(SimdPack(Vectors::spread(load[k], p) * Vectors::repeat(direction)), batch.place(p), given);
    }
    cells.scatter(cell, given, 1., sums);
    cells.scatter_to(cell, moments, given_numbers);
    begin = cell.end;
  }
  EXPECT_EQ(n_seen, n);
  EXPECT_GT(n_hanging, 20);
  EXPECT_LT((sums - expected).topRows<dim>().cwiseAbs().maxCoeff(), 100. * round_off); // sums over the entries of a node
  for (int a = 0; a < interpolation.n_window(); ++a)
  {
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(given_numbers[a][c], expected(c, a), 100. * round_off);
    EXPECT_NEAR(given_numbers[a][3], 4. * expected(0, a), 100. * round_off);
  }
}
} // namespace

TEST(CellBatches, AgreeWithShapeFunctionsInPlane)
{
  compare_with_shape_functions<2>();
}

TEST(CellBatches, AgreeWithShapeFunctionsInSpace)
{
  compare_with_shape_functions<3>();
}

// A window may show nodes around those of the entries. What is kept for the nodes of the entries alone must not be looked up
// there, not even times zero.
TEST(CellBatches, TakeNoNodesThatNoLinkHas)
{
  const auto side = refined_side<2>();
  dem::Packing packing;
  packing.positions.resize(3, 1);
  packing.positions.col(0) << 3.5 * h, 0., 0.; // on a side: the upper corners of its cell do not carry it
  packing.radii = Eigen::VectorXd::Constant(1, 0.1 * h);
  test::DummyParticles particles(packing.positions);
  ParticleInterpolation interpolation(packing, WindowNodes::own, MPI_COMM_WORLD);
  std::vector<int> around;
  for (int node = 0; node < side->mesh().n_nodes(); ++node)
    if (side->mesh().nodes(0, node) > 2.5 * h) // where no node hangs
      around.push_back(node);
  interpolation.widen([&](int) { return around; });
  interpolation.set_particles(std::vector<TiedParticle>(1, TiedParticle{0}));
  interpolation.update(particles.view(), *side);
  ASSERT_EQ(interpolation.n_carriers(), 2);
  ASSERT_EQ(interpolation.n_window(), static_cast<int>(around.size()));
  CellBatches<2> cells;
  cells.assign(interpolation, side->mesh(), packing);
  ASSERT_EQ(cells.cells().size(), 1u);
  for (const int node : cells.cells()[0].node)
    EXPECT_LT(node, interpolation.n_carriers());
}
