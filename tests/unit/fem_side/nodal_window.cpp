// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
class FemExchange : public ::testing::Test
{
protected:
  FemExchange() : side(make_fem_side(box({0.8, 0.5, 0.}, 0.1)))
  {
    const int n = side->mesh().n_nodes();
    u = noise_field(n, 0.004, 11);
    v = noise_field(n, 3., 12);
    side->set_state(u, v);
    side->compute_forces();
    MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  }

  /// Other nodes on every rank, none on rank 1, some twice, most of them owned elsewhere.
  std::vector<int> window_nodes() const
  {
    std::vector<int> nodes;
    if (this_rank() == 1)
      return nodes;
    for (int i = side->mesh().n_nodes() - 1 - this_rank(); i >= 0; i -= 2 + this_rank())
      nodes.push_back(i);
    nodes.push_back(nodes.front());
    return nodes;
  }

  std::unique_ptr<FemSide> side;
  Eigen::Matrix3Xd u, v;
  int n_ranks = 1;
};
} // namespace

TEST_F(FemExchange, WindowReadsNodalValues)
{
  const std::vector<int> nodes = window_nodes();
  side->set_window(nodes);
  const Eigen::Matrix3Xd force = side->gather(NodalField::force), mass = side->gather(NodalField::mass);
  Eigen::Matrix3Xd values;
  const std::pair<NodalField, const Eigen::Matrix3Xd *> fields[] = {
    {NodalField::displacement, &u}, {NodalField::velocity, &v}, {NodalField::force, &force}, {NodalField::mass, &mass}};
  for (const auto &[field, expected] : fields)
  {
    side->read_window(field, values);
    ASSERT_EQ(values.cols(), static_cast<int>(nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i)
      EXPECT_EQ(values.col(i), expected->col(nodes[i]));
  }
  // Corner, edge and inner node carry 1/4, 1/2 and 1 cell mass.
  EXPECT_NEAR(mass(0, 0), 0.25 * 2650. * 0.01, 1e-11);
  EXPECT_EQ(mass(2, 0), mass(0, 0));
  EXPECT_NEAR(mass.row(0).maxCoeff(), 2650. * 0.01, 1e-11);
}

// Work of window forces on window displacements equals work of the nodal forces, and nothing of the force is lost.
TEST_F(FemExchange, WindowForcesAreTheTransposeOfReading)
{
  const std::vector<int> nodes = window_nodes();
  side->set_window(nodes);
  const Eigen::Matrix3Xd before = side->gather(NodalField::force);
  Eigen::Matrix3Xd seen;
  side->read_window(NodalField::displacement, seen);
  const Eigen::Matrix3Xd push = noise_field(static_cast<int>(nodes.size()), 1e7, 100 + this_rank());
  side->add_window_forces(push);
  const Eigen::Matrix3Xd change = side->gather(NodalField::force) - before;
  const double scale = 1e7 * n_ranks * nodes.size() + 1e7;
  EXPECT_NEAR(global_sum(push.cwiseProduct(seen).sum()), change.cwiseProduct(u).sum(), 1e-13 * scale);
  for (int d = 0; d < 2; ++d)
    EXPECT_NEAR(global_sum(push.row(d).sum()), change.row(d).sum(), 1e-12 * scale);
  EXPECT_GT(change.norm(), 1e7);
  EXPECT_THROW(side->add_window_forces(Eigen::Matrix3Xd::Zero(3, nodes.size() + 1)), std::logic_error);
}

// Weighted length of the whole boundary; alpha is constant in each half.
TEST_F(FemExchange, SurfacePointsCoverTheWeightedBoundary)
{
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(10.);
  SurfacePoints points;
  side->surface_points(-far, far, {}, points);
  EXPECT_NEAR(global_sum(points.area.sum()), 2. * (0.8 + 0.5), 1e-13);

  set_weights(*side, [](const Eigen::Vector3d &X) { return X[0] < 0.4 ? 0.5 : 0.; });
  side->surface_points(-far, far, {}, points);
  EXPECT_NEAR(global_sum(points.area.sum()), 0.5 * (2. * 0.4 + 0.5), 1e-13);
  // Left half only, wherever the noise has moved it.
  for (int i = 0; i < points.position.cols(); ++i)
    EXPECT_LT(points.position(0, i), 0.4 + 0.004);
}

TEST_F(FemExchange, SurfacePointsAreCurrentAndFiltered)
{
  Eigen::Matrix3Xd moved = Eigen::Matrix3Xd::Zero(3, side->mesh().n_nodes());
  moved.row(0).setConstant(5.);
  side->set_state(moved, v);
  side->compute_forces();
  SurfacePoints points;
  // A box about the middle of the moved top edge, well inside one face: the whole face is given.
  side->surface_points({5.34, 0.49, -1.}, {5.36, 0.6, 1.}, {}, points);
  EXPECT_EQ(global_sum(points.position.cols()), 2.);
  for (int i = 0; i < points.position.cols(); ++i)
  {
    EXPECT_NEAR(std::abs(points.position(0, i) - 5.35), 0.05 / std::sqrt(3.), 1e-12);
    EXPECT_NEAR(points.position(1, i), 0.5, 1e-12);
    EXPECT_NEAR(points.area[i], 0.05, 1e-14);
  }
  side->surface_points({0., 0., -1.}, {4.9, 1., 1.}, {}, points);
  EXPECT_EQ(points.position.cols(), 0);
}

// A search for what is nearer than 0.08 to a place finds all of it, and not the whole boundary.
TEST_F(FemExchange, SurfacePointsNearAPlace)
{
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(10.), place(0.33, 0.47, 0.);
  const double reach = 0.08;
  const auto count = [&](const SurfacePoints &points)
  { return global_sum(((points.position.colwise() - place).colwise().norm().array() < reach).count()); };
  SurfacePoints all, some;
  side->surface_points(-far, far, {}, all);
  side->surface_points(
    -far, far, [&](const Eigen::Vector3d &centre, double radius) { return (centre - place).norm() < radius + reach; }, some);
  EXPECT_GT(count(some), 0.);
  EXPECT_EQ(count(some), count(all));
  EXPECT_LT(global_sum(some.position.cols()), 0.3 * global_sum(all.position.cols()));
}

// Consistent distribution: power of point forces equals power of nodal forces, total force is kept.
TEST_F(FemExchange, SurfaceForcesKeepForceAndPower)
{
  const Eigen::Matrix3Xd before = side->gather(NodalField::force);
  SurfacePoints points;
  side->surface_points({-1., 0.4, -1.}, {1., 1., 1.}, {}, points);
  EXPECT_GE(global_sum(points.position.cols()), 20.); // 8 faces on top and two at least beside it
  const Eigen::Matrix3Xd push = noise_field(static_cast<int>(points.position.cols()), 1e7, 200 + this_rank());
  side->add_surface_forces(push, SurfaceLoad::tool);
  const Eigen::Matrix3Xd change = side->gather(NodalField::force) - before;
  const double scale = 1e7 * 20.;
  EXPECT_NEAR(global_sum(push.cwiseProduct(points.velocity).sum()), change.cwiseProduct(v).sum(), 1e-12 * 3. * scale);
  for (int d = 0; d < 2; ++d)
    EXPECT_NEAR(global_sum(push.row(d).sum()), change.row(d).sum(), 1e-12 * scale);
  EXPECT_GT(change.norm(), 1e7);
}

// Extents of 0.1 that differ by round-off, of which some are above two parts of 0.05: all faces have the same number of points,
// and the points are symmetrical about the middle.
TEST(FemSurface, EqualFacesHaveEqualPoints)
{
  Settings settings = box({0.9, 0.3, 0.}, 0.1, MPI_COMM_SELF);
  settings.surface_spacing = 0.025;
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  for (const BoundaryFace &face : mesh.boundary)
    EXPECT_EQ(face_points(mesh, face, settings.surface_spacing).position.cols(), 4);
  const Eigen::Matrix3Xd &X = side->surface_positions();
  EXPECT_EQ(X.cols(), 4 * static_cast<int>(mesh.boundary.size()));
  for (int i = 0; i < X.cols(); ++i)
  {
    const Eigen::Vector3d mirrored(0.9 - X(0, i), X(1, i), 0.);
    EXPECT_LT((X.colwise() - mirrored).colwise().norm().minCoeff(), 1e-14);
  }
}
