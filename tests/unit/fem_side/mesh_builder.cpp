// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/graded_axis.h"
#include "tests/support/fem_fixture.h"

#include <Eigen/LU>
#include <gtest/gtest.h>
#include <set>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
/// Area of a quadrilateral from its diagonals.
double cell_area(const Mesh &mesh, const int cell)
{
  const Eigen::Vector3d a = mesh.nodes.col(mesh.cells(3, cell)) - mesh.nodes.col(mesh.cells(0, cell));
  const Eigen::Vector3d b = mesh.nodes.col(mesh.cells(2, cell)) - mesh.nodes.col(mesh.cells(1, cell));
  return 0.5 * std::abs(a.x() * b.y() - a.y() * b.x());
}
} // namespace

TEST(FemMesh, GradedAxisMeetsEndsFineZoneAndBounds)
{
  const double growths[] = {1., 1.05, 1.2, 1.5};
  for (const double growth : growths)
    for (const double largest : {0., 0.03})
      for (const double length : {0.35, 0.5, 1.013})
      {
        const GradedAxis axis{-0.1, length, 0.01, 0.1, 0.25, growth, largest};
        const std::vector<double> x = vertex_coordinates(axis);
        EXPECT_EQ(x.front(), axis.lower);
        EXPECT_EQ(x.back(), axis.upper);
        double previous = 0.;
        for (std::size_t i = 1; i < x.size(); ++i)
        {
          const double size = x[i] - x[i - 1];
          const double centre = 0.5 * (x[i] + x[i - 1]);
          // The fine zone holds whole cells: with 15 cells the size may differ by 1/30 when a remainder joins it.
          if (centre > 0.1 && centre < 0.25)
          {
            EXPECT_NEAR(size, 0.01, 0.01 / 30.);
          }
          EXPECT_GT(size, 0.0096);
          if (largest > 0.)
          {
            EXPECT_LT(size, largest * (1. + 1e-9));
          }
          if (i > 1)
          {
            EXPECT_LT(std::max(size / previous, previous / size), growth * 1.04) << "growth " << growth;
          }
          previous = size;
        }
        if (growth > 1.)
        {
          EXPECT_LT(x.size(), (axis.upper - axis.lower) / 0.01) << "grading must save cells";
        }
      }
}

TEST(FemMesh, GradedBoxIsFilledExactly)
{
  Settings settings = box({1.3, 0.7, 0.}, 0.02);
  settings.mesh.lower = {-0.2, 0.1, 0.};
  settings.mesh.fine_lower = {0.3, 0.5, 0.};
  settings.mesh.fine_upper = {0.6, 0.7, 0.};
  settings.mesh.growth = 1.15;
  settings.mesh.largest_cell_size = 0.08;
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  EXPECT_EQ(mesh.nodes.row(0).minCoeff(), -0.2);
  EXPECT_EQ(mesh.nodes.row(0).maxCoeff(), 1.3);
  EXPECT_EQ(mesh.nodes.row(1).minCoeff(), 0.1);
  EXPECT_EQ(mesh.nodes.row(1).maxCoeff(), 0.7);
  double area = 0.;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    area += cell_area(mesh, cell);
  EXPECT_NEAR(area, 1.5 * 0.6, 1e-12); // round-off of some thousand terms
  // The weighted mass is the independent quadrature of the same area.
  EXPECT_NEAR(side->gather(NodalField::mass).row(0).sum(), 1.5 * 0.6 * rock().density, 1e-9);
}

TEST(FemMesh, BoundaryIdsOfTheBox)
{
  const auto side = make_fem_side(box({0.4, 0.3, 0.}, 0.1));
  const Mesh &mesh = side->mesh();
  int count[4] = {0, 0, 0, 0};
  const double limit[4] = {0., 0.4, 0., 0.3};
  for (const BoundaryFace &face : mesh.boundary)
  {
    ASSERT_TRUE(face.id >= 0 && face.id < 4);
    ++count[face.id];
    for (int a = 0; a < 2; ++a)
      EXPECT_EQ(mesh.nodes(face.id / 2, face.nodes[a]), limit[face.id]);
  }
  EXPECT_EQ(count[0], 3);
  EXPECT_EQ(count[1], 3);
  EXPECT_EQ(count[2], 4);
  EXPECT_EQ(count[3], 4);
}

// The rim is a polygon with its corners on the circle: of n edges, area pi R^2 (1 - 2 pi^2/(3 n^2)) to leading order.
TEST(FemMesh, DiscAndCylinder)
{
  const double radius = 0.25, height = 0.3;
  for (const int dim : {2, 3})
  {
    Settings settings = box({0.6, 0.6, 0.}, 0.02);
    settings.dim = dim;
    settings.mesh.shape = MeshShape::disc;
    settings.mesh.lower = {0.1, 0.1, -0.1};
    settings.mesh.upper = {0.6, 0.6, height - 0.1};
    const auto side = make_fem_side(settings);
    const Mesh &mesh = side->mesh();
    int n_rim = 0;
    for (const BoundaryFace &face : mesh.boundary)
    {
      ASSERT_TRUE(face.id == 0 || (dim == 3 && (face.id == 4 || face.id == 5)));
      for (int a = 0; a < 1 << (dim - 1); ++a)
      {
        const Eigen::Vector3d x = mesh.nodes.col(face.nodes[a]);
        if (face.id == 0)
        {
          EXPECT_NEAR((x - Eigen::Vector3d(0.35, 0.35, x.z())).norm(), radius, 1e-12);
        }
        else
        {
          EXPECT_NEAR(x.z(), face.id == 4 ? -0.1 : height - 0.1, 1e-12);
        }
      }
      n_rim += face.id == 0;
    }
    const int layers = dim == 2 ? 1 : 15;
    const double n_edges = n_rim / layers, volume = M_PI * radius * radius * (dim == 2 ? 1. : height);
    EXPECT_GE(n_edges, 2. * M_PI * radius / 0.02);
    const double missing = 2. * M_PI * M_PI / (3. * n_edges * n_edges);
    const double mass = side->gather(NodalField::mass).row(0).sum();
    EXPECT_NEAR(mass / (rock().density * volume), 1. - missing, 0.02 * missing); // next term of the series is far smaller
  }
  Settings flattened = box({0.5, 0.5, 0.}, 0.02);
  flattened.mesh.shape = MeshShape::disc;
  flattened.mesh.flat_angle = 0.15;
  const auto side = make_fem_side(flattened);
  const Eigen::Matrix3Xd &nodes = side->mesh().nodes;
  EXPECT_NEAR(nodes.row(1).maxCoeff() - nodes.row(1).minCoeff(), 0.5 * std::cos(0.15), 1e-12);
  EXPECT_NEAR(nodes.row(0).maxCoeff() - nodes.row(0).minCoeff(), 0.5, 1e-12);
  Settings oval = box({0.6, 0.5, 0.}, 0.02);
  oval.mesh.shape = MeshShape::disc;
  EXPECT_THROW(make_fem_side(oval), std::invalid_argument);
}

TEST(FemMesh, EveryCellHasOneOwnerAndRanksShareFairly)
{
  const auto side = make_fem_side(box({1., 0.7, 0.}, 0.1));
  int n_ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  const int n_owned = static_cast<int>(side->owned_cells().size());
  EXPECT_EQ(global_sum(n_owned), side->mesh().n_cells());
  EXPECT_NEAR(n_owned, 70. / n_ranks, 1.);
  for (const int cell : side->owned_cells())
    EXPECT_EQ(side->mesh().owner[cell], this_rank());
}

TEST(FemMesh, QuadraturePointsLieInTheirCells)
{
  const MshFile file("points");
  write_distorted_msh(file.path, 7, 5, 0.1);
  Settings settings = box({0., 0., 0.}, 0.);
  settings.mesh.gmsh_file = file.path;
  const auto side = make_fem_side(settings);
  ASSERT_EQ(side->quadrature_points().cols(), 4 * static_cast<int>(side->owned_cells().size()));
  const auto found = side->locate(side->quadrature_points());
  for (std::size_t i = 0; i < found.size(); ++i)
    EXPECT_EQ(found[i].cell, side->owned_cells()[i / 4]);
}

TEST(FemMesh, LocateReproducesPositionsAndGradients)
{
  const MshFile file("locate");
  const double h = 0.1;
  write_distorted_msh(file.path, 9, 6, h);
  Settings settings = box({0., 0., 0.}, 0.);
  settings.mesh.gmsh_file = file.path;
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();

  Eigen::Matrix3Xd points = noise_field(2000, 0.5, 3);
  points.row(0) = (points.row(0).array() + 0.5) * 9 * h;
  points.row(1) = (points.row(1).array() + 0.5) * 6 * h;
  const auto found = side->locate(points);
  for (int i = 0; i < points.cols(); ++i)
  {
    ASSERT_GE(found[i].cell, 0);
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero(); // of the position itself: the identity
    for (int a = 0; a < found[i].n; ++a)
    {
      EXPECT_EQ(found[i].nodes[a], mesh.cells(a, found[i].cell));
      EXPECT_GT(found[i].N[a], -1e-8);
      x += found[i].N[a] * mesh.nodes.col(found[i].nodes[a]);
      gradient += mesh.nodes.col(found[i].nodes[a]) * found[i].dN.col(a).transpose();
    }
    EXPECT_LT((x - points.col(i)).norm(), 1e-13);
    EXPECT_LT((gradient.topLeftCorner<2, 2>() - Eigen::Matrix2d::Identity()).norm(), 1e-11);
  }

  // Gradients against differences of the interpolation of a bilinear displacement inside one cell, error O(step) of N itself.
  const Eigen::Matrix3Xd u = noise_field(mesh.n_nodes(), 1., 8);
  const double step = 1e-7;
  const auto value = [&u](const Interpolation &at)
  {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int a = 0; a < at.n; ++a)
      sum += at.N[a] * u.col(at.nodes[a]);
    return sum;
  };
  Eigen::Matrix3Xd centre = side->quadrature_points().leftCols(1);
  const Interpolation at = side->locate(centre)[0];
  for (int d = 0; d < 2; ++d)
  {
    Eigen::Matrix3Xd shifted(3, 2);
    shifted << centre, centre;
    shifted(d, 0) += step;
    shifted(d, 1) -= step;
    const auto sides = side->locate(shifted);
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (int a = 0; a < at.n; ++a)
      gradient += at.dN(d, a) * u.col(at.nodes[a]);
    EXPECT_LT((gradient - (value(sides[0]) - value(sides[1])) / (2. * step)).norm(), 1e-5);
  }
}

TEST(FemMesh, LocateOnFacesAndOutside)
{
  const double h = 0.1;
  const auto side = make_fem_side(box({0.8, 0.5, 0.}, h));
  const double offset = 1e-10 * h;
  Eigen::Matrix3Xd inside = Eigen::Matrix3Xd::Zero(3, 6), outside = Eigen::Matrix3Xd::Zero(3, 4);
  inside.topRows<2>() << 0., 0.8, -offset, 0.8 + offset, 0.3 + offset, 0.35, //
    0., 0.5, 0.25, 0.31, 0.2 - offset, 0.5 + offset;
  outside.topRows<2>() << -0.001 * h, 0.8 + 1e-6 * h, 0.4, 5., //
    0.25, 0.25, 0.51, -3.;
  for (const Interpolation &point : side->locate(inside))
    EXPECT_GE(point.cell, 0);
  for (const Interpolation &point : side->locate(outside))
    EXPECT_EQ(point.cell, -1);
}

TEST(FemMesh, UnusableInputGivesOneLine)
{
  const auto contains = [](const std::string &text, const std::string &part)
  { return text.find(part) != std::string::npos && text.find('\n') == std::string::npos; };

  const MshFile skewed("skewed");
  write_distorted_msh(skewed.path, 4, 3, 0.1, 0.05);
  Settings settings = box({0., 0., 0.}, 0.);
  settings.mesh.gmsh_file = skewed.path;
  settings.boundary_conditions = {condition(2, BoundaryKind::roller)};
  EXPECT_EQ(error_of(settings), "");
  settings.boundary_conditions = {condition(1, BoundaryKind::roller)};
  EXPECT_TRUE(contains(error_of(settings), "roller on id 1"));
  settings.boundary_conditions = {condition(7, BoundaryKind::fixed)};
  EXPECT_TRUE(contains(error_of(settings), "no boundary id 7, it has 0 1 2 3"));

  const MshFile triangles("triangles");
  std::ofstream(triangles.path) << "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 1 1 0\n4 0 1 0\n"
                                   "$EndNodes\n$Elements\n2\n1 2 2 9 9 1 2 3\n2 2 2 9 9 1 3 4\n$EndElements\n";
  settings.boundary_conditions.clear();
  settings.mesh.gmsh_file = triangles.path;
  EXPECT_TRUE(contains(error_of(settings), "triangles"));

  settings.mesh.gmsh_file = triangles.path + ".missing";
  EXPECT_TRUE(contains(error_of(settings), "cannot be opened"));
  const MshFile broken("broken");
  std::ofstream(broken.path) << "no mesh\n";
  settings.mesh.gmsh_file = broken.path;
  EXPECT_TRUE(contains(error_of(settings), "not a gmsh mesh"));

  EXPECT_TRUE(contains(error_of(box({1., 0., 0.}, 0.1)), "upper box corner"));
  EXPECT_TRUE(contains(error_of(box({1., 1., 0.}, 0.)), "cell size"));
  Settings soft = box({1., 1., 0.}, 0.5);
  soft.material.poisson = 0.5;
  EXPECT_TRUE(contains(error_of(soft), "Poisson"));
}
