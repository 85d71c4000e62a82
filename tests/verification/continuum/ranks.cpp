// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// All kinds of boundaries and loads, hanging nodes, weights that vary and switch cells off, forces on a window and on the
/// surface.
class Problem
{
public:
  Problem(MPI_Comm comm, const int dim, const Integration integration) : comm(comm), h(dim == 2 ? 0.02 : 0.05)
  {
    const double depth = dim == 2 ? 0. : 4. * h;
    Settings settings = box({0.8, 0.5, depth}, h, comm);
    settings.mesh.fine_lower = {0.2, 0.3, 0.};
    settings.mesh.fine_upper = {0.5, 0.5, 0.5 * depth};
    settings.mesh.growth = 1.2;
    settings.integration = integration;
    BoundaryCondition push = condition(0, BoundaryKind::velocity);
    push.velocity = {2., 0.5, 0.};
    push.ramp = 2e-5;
    BoundaryCondition press;
    press.where = "y > 0.5 - 1e-6 && x < 0.2";
    press.kind = BoundaryKind::traction;
    press.traction = {1e5, -2e6, 0.};
    press.ramp = 1e-5;
    settings.boundary_conditions = {push, press, condition(1, BoundaryKind::absorbing), condition(2, BoundaryKind::roller)};
    if (dim == 3)
      settings.boundary_conditions.push_back(condition(4, BoundaryKind::absorbing));
    settings.mesh.refined = {{{0.5, 0.1, 0.}, {0.7, 0.2, 0.5 * depth}, 1}};
    settings.initial_stress.diagonal() << -1e6, -2e6, 0.;
    settings.gravity = {0., -9.81, 0.};
    settings.gravity_ramp = 1e-5;
    side = make_fem_side(settings);
    set_weights(3.);
    dt = 0.8 * make_stable();
  }

  void run(const int n_steps)
  {
    int rank = 0, n_ranks = 1;
    MPI_Comm_rank(comm, &rank);
    MPI_Comm_size(comm, &n_ranks);
    // Every rank pushes its share of the nodes, which are mostly not its own.
    std::vector<char> slave(side->mesh().n_nodes(), 0);
    for (const SlaveNode &s : side->mesh().slaves)
      slave[s.node] = 1;
    std::vector<int> nodes;
    for (int i = 0; i < side->mesh().n_nodes(); ++i)
      if (i % n_ranks == rank && !slave[i])
        nodes.push_back(i);
    side->set_window(nodes);
    for (int n = 1; n <= n_steps; ++n)
    {
      if (n == n_steps / 2) // more cells switch off in mid-run
        set_weights(5.);
      side->begin_step(dt, n * dt);
      side->compute_forces();
      Eigen::Matrix3Xd v;
      side->read_window(NodalField::velocity, v);
      side->add_window_forces(-10. * v);
      SurfacePoints points;
      side->surface_points({0.2, 0.45, -1.}, {0.5, 0.55, 1.}, {}, points);
      Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, points.area.size());
      load.row(1) = -1e6 * points.area.transpose();
      side->add_surface_forces(load, SurfaceLoad::tool);
      side->end_step(dt, n * dt);
    }
  }

  std::unique_ptr<FemSide> side;
  double dt = 0.;

private:
  /// @param hole radius of what is switched off [h]
  void set_weights(const double hole)
  {
    kerf::fem::test::set_weights(*side, [&](const Eigen::Vector3d &X)
                                 { return std::clamp((std::hypot(X[0] - 0.6, X[1] - 0.5) / h - hole) / 5., 0., 1.); });
  }
  double make_stable() const { return side->stable_step(); }

  MPI_Comm comm;
  double h; ///< cell size [m]
};

void expect_equal(const Eigen::Matrix3Xd &a, const Eigen::Matrix3Xd &b, const double tolerance)
{
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), tolerance * b.cwiseAbs().maxCoeff());
}
} // namespace

class FemRanks : public ::testing::TestWithParam<std::tuple<int, Integration>>
{
};
INSTANTIATE_TEST_SUITE_P(All, FemRanks,
                         ::testing::Combine(::testing::Values(2, 3),
                                            ::testing::Values(Integration::full, Integration::selective,
                                                              Integration::one_point)));

// Ranks change only the order of sums. Displacements of 300 steps agree to 1e-12. Strains are differences of displacements, so
// forces carry round-off eps u E and velocities at the highest frequency eps u/dt: with u = 600 dt v that is a hundred times
// more.
TEST_P(FemRanks, ManyRanksGiveTheAnswerOfOne)
{
  const auto [dim, integration] = GetParam();
  Problem alone(MPI_COMM_SELF, dim, integration), together(MPI_COMM_WORLD, dim, integration);
  EXPECT_EQ(alone.side->n_active_cells(), together.side->n_active_cells());
  EXPECT_EQ(alone.side->mesh().nodes, together.side->mesh().nodes);
  EXPECT_EQ(alone.side->mesh().cells, together.side->mesh().cells);
  EXPECT_NEAR(together.dt, alone.dt, 1e-6 * alone.dt);
  together.dt = alone.dt;
  const int n_steps = dim == 2 ? 300 : 100; // enough for waves to cross the borders of all ranks
  alone.run(n_steps);
  together.run(n_steps);
  for (const NodalField field : {NodalField::displacement, NodalField::velocity, NodalField::force, NodalField::mass})
  {
    const bool differentiated = field == NodalField::velocity || field == NodalField::force;
    expect_equal(together.side->gather(field), alone.side->gather(field), differentiated ? 3e-11 : 1e-12);
  }
  const Energies a = alone.side->energies(), b = together.side->energies();
  EXPECT_GT(a.absorbed, 0.);
  EXPECT_NEAR(b.kinetic, a.kinetic, 1e-11 * a.kinetic);
  EXPECT_NEAR(b.elastic, a.elastic, 1e-11 * a.elastic);
  EXPECT_NEAR(b.boundary, a.boundary, 1e-11 * a.boundary);
  EXPECT_NEAR(b.absorbed, a.absorbed, 1e-11 * a.absorbed);
}
