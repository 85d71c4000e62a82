// SPDX-License-Identifier: GPL-2.0-or-later
// Meshes that repeat themselves across y (and z): bodies without sides.
#include "tests/support/fem_fixture.h"

#include <algorithm>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
constexpr double h = 0.01;

Settings strip(const int nx, const int ny, MPI_Comm comm = MPI_COMM_WORLD)
{
  Settings settings = box({nx * h, ny * h, 0.}, h, comm);
  settings.mesh.periodic = {{false, true, false}};
  return settings;
}

Settings bar(const int nx, const int ny, const int nz, MPI_Comm comm = MPI_COMM_WORLD)
{
  Settings settings = box({nx * h, ny * h, nz * h}, h, comm);
  settings.mesh.periodic = {{false, true, true}};
  return settings;
}

double volume(const Mesh &mesh)
{
  const Eigen::Vector3d extent = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
  return extent[0] * extent[1] * (mesh.dim == 3 ? extent[2] : 1.);
}

bool is_image(const Mesh &mesh, const int node)
{
  return std::any_of(mesh.slaves.begin(), mesh.slaves.end(), [node](const SlaveNode &slave) { return slave.node == node; });
}

/// A chain of masses: what the nodes of a plane x = const do in a linear plane wave. Same steps as the program.
class Chain
{
public:
  Chain(const Eigen::VectorXd &u, const Eigen::VectorXd &v, const double modulus, const double density)
    : u(u), v(v), stiffness(modulus / h), mass(Eigen::VectorXd::Constant(u.size(), density * h))
  {
    mass[0] *= 0.5;
    mass[u.size() - 1] *= 0.5;
  }
  void step(const double dt)
  {
    v += 0.5 * dt * acceleration();
    u += dt * v;
    v += 0.5 * dt * acceleration();
  }
  Eigen::VectorXd u, v;

private:
  Eigen::VectorXd acceleration() const
  {
    const Eigen::Index n = u.size();
    Eigen::VectorXd f = Eigen::VectorXd::Zero(n);
    const Eigen::VectorXd spring = stiffness * (u.tail(n - 1) - u.head(n - 1));
    f.head(n - 1) += spring;
    f.tail(n - 1) -= spring;
    return f.cwiseQuotient(mass);
  }
  double stiffness;
  Eigen::VectorXd mass;
};

/// A pulse of half length 8 h that starts at rest and splits; displacements along @p direction.
void expect_chain(const Settings &settings, const int direction)
{
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  const double amplitude = 1e-10; // strains of 1e-9: the finite-strain law is linear to that
  const auto place = [&](const int node) { return static_cast<int>(std::lround(mesh.nodes(0, node) / h)); };
  const int n = static_cast<int>(std::lround(mesh.nodes.row(0).maxCoeff() / h)) + 1;
  Eigen::VectorXd start = Eigen::VectorXd::Zero(n);
  for (int i = 0; i < n; ++i)
    if (std::abs(i - 15) < 8)
      start[i] = amplitude * std::pow(std::cos(M_PI * (i - 15) / 16.), 2);
  Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, mesh.n_nodes());
  for (int i = 0; i < mesh.n_nodes(); ++i)
    u(direction, i) = start[place(i)];
  side->set_state(u, 0. * u);

  const Material &rock = settings.material;
  const double speed = direction == 0 ? rock.speed_p() : rock.speed_s();
  Chain chain(start, Eigen::VectorXd::Zero(n), rock.density * speed * speed, rock.density);
  const double dt = 0.7 * side->stable_step();
  for (int k = 1; k <= 60; ++k)
  {
    step(*side, dt, k * dt);
    chain.step(dt);
  }
  const Eigen::Matrix3Xd now = side->gather(NodalField::displacement);
  // Round-off of 60 steps; along and across the motion alike, on all nodes of a plane x = const, at the ends, too.
  double worst = 0., across = 0.;
  for (int i = 0; i < mesh.n_nodes(); ++i)
  {
    worst = std::max(worst, std::abs(now(direction, i) - chain.u[place(i)]));
    for (int c = 0; c < 3; ++c)
      if (c != direction)
        across = std::max(across, std::abs(now(c, i)));
  }
  EXPECT_GT(chain.u.cwiseAbs().maxCoeff(), 0.1 * amplitude);
  EXPECT_LT(worst, 2e-8 * amplitude);
  EXPECT_LT(across, 2e-8 * amplitude);
  const Energies energies = side->energies();
  EXPECT_GT(energies.kinetic, 0.);
}
} // namespace

// Between y = const the cells of a plane wave are those of a chain with the moduli of the unbounded body, rho c_p^2 and rho
// c_s^2. Strains of 1e-9 leave 1e-9 of the second order of the law, for S waves along x.
TEST(FemPeriodic, PlaneWavesAreThoseOfAnUnboundedBody)
{
  expect_chain(strip(40, 3), 0);
  expect_chain(strip(40, 3), 1);
  for (const int direction : {0, 1, 2})
    expect_chain(bar(32, 2, 3), direction);
}

TEST(FemPeriodic, MassIsWhole)
{
  for (const Settings &settings : {strip(8, 2), bar(6, 2, 3)})
  {
    const auto side = make_fem_side(settings);
    const Mesh &mesh = side->mesh();
    const Eigen::Matrix3Xd mass = side->gather(NodalField::mass);
    const double whole = settings.material.density * volume(mesh);
    EXPECT_NEAR(mass.row(0).sum(), whole, 1e-13 * whole);
    // Masters inside carry a whole cell's mass, also at the seam.
    const double of_cell = settings.material.density * std::pow(h, mesh.dim);
    for (int i = 0; i < mesh.n_nodes(); ++i)
    {
      const bool at_end = mesh.nodes(0, i) < 0.5 * h || mesh.nodes(0, i) > mesh.nodes.row(0).maxCoeff() - 0.5 * h;
      EXPECT_NEAR(mass(0, i), is_image(mesh, i) ? 0. : of_cell * (at_end ? 0.5 : 1.), 1e-12 * of_cell);
    }
    for (const BoundaryFace &face : mesh.boundary)
      EXPECT_LT(face.id, 2);
    EXPECT_EQ(static_cast<int>(mesh.boundary.size()), mesh.dim == 2 ? 4 : 12);
  }
}

// Patch test: uniform stretch along x and shear across it on a distorted mesh have no forces but at the ends. The mesh is not
// structured, so the sides are found by their place. Forces of a cell's side are E strain h = 4e5 N; round-off of 1e-15 of it.
TEST(FemPeriodic, UniformStrainOnADistortedMeshHasNoForcesAtTheSeam)
{
  const MshFile file("periodic");
  write_distorted_msh(file.path, 12, 6, h);
  Settings settings = strip(1, 1);
  settings.mesh.gmsh_file = file.path;
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  EXPECT_NEAR(mesh.period[1], 6. * h, 1e-15);
  Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
  gradient.col(0) << 1e-3, 2e-3, 0.;
  side->set_state(gradient * mesh.nodes, Eigen::Matrix3Xd::Zero(3, mesh.n_nodes()));
  side->compute_forces();
  const Eigen::Matrix3Xd force = side->gather(NodalField::force);
  double inside = 0., at_ends = 0.;
  for (int i = 0; i < mesh.n_nodes(); ++i)
  {
    const bool at_end = mesh.nodes(0, i) < 1e-9 || mesh.nodes(0, i) > 12. * h - 1e-9;
    (at_end ? at_ends : inside) = std::max(at_end ? at_ends : inside, force.col(i).norm());
  }
  EXPECT_GT(at_ends, 1e5);
  EXPECT_LT(inside, 1e-12 * at_ends);
}

TEST(FemPeriodic, PointsAreFoundAcrossTheSeam)
{
  const auto side = make_fem_side(bar(4, 3, 2));
  const Mesh &mesh = side->mesh();
  // Nodal values of functions that repeat themselves are those of the masters, so interpolation at an image is the same.
  Eigen::Matrix3Xd points(3, 3);
  points << 1.3 * h, 1.3 * h, 4. * h, 2.9 * h, -0.1 * h, 7. * h, 0.2 * h, 4.2 * h, -2. * h;
  const auto found = side->locate(points);
  for (const Interpolation &row : found)
  {
    ASSERT_GE(row.cell, 0);
    double sum = 0.;
    for (int a = 0; a < row.n; ++a)
    {
      sum += row.N[a];
      EXPECT_FALSE(is_image(mesh, row.nodes[a]));
    }
    EXPECT_NEAR(sum, 1., 1e-14);
  }
  EXPECT_EQ(found[0].cell, found[1].cell);
  for (int a = 0; a < found[0].n; ++a)
    EXPECT_NEAR(found[0].N[a], found[1].N[a], 1e-9);
  // Outside of the ends there is nothing.
  Eigen::Matrix3Xd outside(3, 1);
  outside << 4.1 * h, 0., 0.;
  EXPECT_EQ(side->locate(outside)[0].cell, -1);
}

// A point on the upper side pushes the nodes of the lower one, and conditions hold both.
TEST(FemPeriodic, WindowsAndConditionsReachTheMaster)
{
  Settings settings = strip(4, 2);
  settings.boundary_conditions = {condition(0, BoundaryKind::fixed)};
  const auto side = make_fem_side(settings);
  const Mesh &mesh = side->mesh();
  Eigen::Matrix3Xd corner(3, 1);
  corner << 4. * h, 2. * h, 0.;
  const Interpolation found = side->locate(corner)[0];
  ASSERT_GE(found.cell, 0);
  const std::vector<int> nodes(found.nodes.begin(), found.nodes.begin() + found.n);
  side->set_window(this_rank() == 0 ? nodes : std::vector<int>{});
  side->compute_forces();
  Eigen::Matrix3Xd push = Eigen::Matrix3Xd::Zero(3, this_rank() == 0 ? found.n : 0);
  for (int a = 0; a < push.cols(); ++a)
    push(0, a) = 5. * found.N[a];
  side->add_window_forces(push);
  const Eigen::Matrix3Xd force = side->gather(NodalField::force);
  for (int i = 0; i < mesh.n_nodes(); ++i)
  {
    const bool pushed = mesh.nodes(0, i) > 3.5 * h && mesh.nodes(1, i) < 0.5 * h;
    EXPECT_NEAR(force(0, i), pushed ? 5. : 0., 1e-12);
  }

  side->set_state(Eigen::Matrix3Xd::Zero(3, mesh.n_nodes()), noise_field(mesh.n_nodes(), 1., 3));
  for (int k = 1; k <= 5; ++k)
    step(*side, 1e-7, k * 1e-7);
  const Eigen::Matrix3Xd v = side->gather(NodalField::velocity);
  for (int i = 0; i < mesh.n_nodes(); ++i)
    if (mesh.nodes(0, i) < 0.5 * h)
      EXPECT_EQ(v.col(i).norm(), 0.);
    else
      EXPECT_GT(v.col(i).norm(), 0.);
}

// Every cell has four neighbours along the seam's axis and along the strip, the ends three; in space six and five.
TEST(FemPeriodic, CellsAreNeighboursAcrossTheSeam)
{
  for (const Settings &settings : {strip(6, 3), bar(4, 3, 3)})
  {
    const auto side = make_fem_side(settings);
    const Mesh &mesh = side->mesh();
    const double length = mesh.nodes.row(0).maxCoeff();
    for (int cell = 0; cell < mesh.n_cells(); ++cell)
    {
      const double x = mesh.nodes(0, mesh.cells(0, cell));
      const bool at_end = x < 0.5 * h || x > length - 1.5 * h;
      EXPECT_EQ(static_cast<int>(mesh.neighbours[cell].size()), 2 * mesh.dim - at_end);
    }
  }
}

// A strip that is refined in its middle from side to side, and at the seam: hanging nodes there have masters on both sides.
// Uniform strain leaves no force inside, masses are whole.
TEST(FemPeriodic, HangingNodesAtTheSeam)
{
  for (Settings settings : {strip(8, 4), bar(6, 3, 4)})
  {
    const double top = settings.mesh.upper[1];
    const double depth = settings.mesh.upper[2];
    for (const double y : {0., top - 0.5 * h})
      for (const double z : {0., depth > 0. ? depth - 0.5 * h : 0.})
      {
        RefinedBox refined;
        refined.lower = {2.5 * h, y, z};
        refined.upper = {3.5 * h, y + 0.5 * h, depth > 0. ? z + 0.5 * h : 0.};
        settings.mesh.refined.push_back(refined);
      }
    const auto side = make_fem_side(settings);
    const Mesh &mesh = side->mesh();
    EXPECT_TRUE(std::any_of(mesh.slaves.begin(), mesh.slaves.end(), [](const SlaveNode &s) { return s.masters.size() > 1; }));
    for (const SlaveNode &slave : mesh.slaves)
      for (const int master : slave.masters)
        EXPECT_FALSE(is_image(mesh, master));
    const double whole = settings.material.density * volume(mesh);
    EXPECT_NEAR(side->gather(NodalField::mass).row(0).sum(), whole, 1e-13 * whole);
    Eigen::Matrix3d gradient = Eigen::Matrix3d::Zero();
    gradient.col(0) << 1e-3, 2e-3, mesh.dim == 3 ? -1e-3 : 0.;
    side->set_state(gradient * mesh.nodes, Eigen::Matrix3Xd::Zero(3, mesh.n_nodes()));
    side->compute_forces();
    const Eigen::Matrix3Xd force = side->gather(NodalField::force);
    double inside = 0., at_ends = 0.;
    for (int i = 0; i < mesh.n_nodes(); ++i)
    {
      const bool at_end = mesh.nodes(0, i) < 1e-9 || mesh.nodes(0, i) > mesh.nodes.row(0).maxCoeff() - 1e-9;
      (at_end ? at_ends : inside) = std::max(at_end ? at_ends : inside, force.col(i).norm());
    }
    EXPECT_LT(inside, 1e-12 * at_ends);
  }
}

// A body that nothing holds keeps its momentum, on any number of ranks like on one.
TEST(FemPeriodic, ManyRanksGiveTheAnswerOfOne)
{
  for (const bool solid : {false, true})
  {
    const auto alone = make_fem_side(solid ? bar(6, 4, 3, MPI_COMM_SELF) : strip(12, 7, MPI_COMM_SELF));
    const auto together = make_fem_side(solid ? bar(6, 4, 3) : strip(12, 7));
    const int n = alone->mesh().n_nodes();
    const Eigen::Matrix3Xd u = noise_field(n, 1e-6, 5, solid ? 3 : 2), v = noise_field(n, 1., 6, solid ? 3 : 2);
    const double dt = 0.5 * alone->stable_step();
    EXPECT_NEAR(together->stable_step(), alone->stable_step(), 1e-3 * alone->stable_step());
    Eigen::Vector3d before = Eigen::Vector3d::Zero();
    const auto momentum = [](const FemSide &side)
    {
      const Eigen::Matrix3Xd velocity = side.gather(NodalField::velocity), mass = side.gather(NodalField::mass);
      return Eigen::Vector3d(velocity.cwiseProduct(mass).rowwise().sum());
    };
    for (FemSide *side : {alone.get(), together.get()})
    {
      side->set_state(u, v);
      before = momentum(*side);
      for (int k = 1; k <= 100; ++k)
        step(*side, dt, k * dt);
      const double scale = side->gather(NodalField::mass).row(0).sum();
      EXPECT_LT((momentum(*side) - before).norm(), 1e-12 * scale);
    }
    const Eigen::Matrix3Xd a = alone->gather(NodalField::displacement), b = together->gather(NodalField::displacement);
    EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-11 * a.cwiseAbs().maxCoeff());
    for (int i = 0; i < n; ++i)
      EXPECT_EQ(is_image(alone->mesh(), i), alone->gather(NodalField::mass)(0, i) == 0.);
    for (const SlaveNode &slave : alone->mesh().slaves)
    {
      ASSERT_EQ(slave.masters.size(), 1u);
      EXPECT_EQ(a.col(slave.node), a.col(slave.masters[0]));
    }
  }
}

TEST(FemPeriodic, MeshesThatDoNotMatchAreNamed)
{
  EXPECT_EQ(error_of(strip(8, 1)),
            "mesh: periodic along y: a cell reaches from one side to the other, at least two cells are needed");
  Settings flat = strip(8, 4);
  flat.mesh.periodic = {{false, false, true}};
  EXPECT_EQ(error_of(flat), "mesh: periodic along z: the mesh has two dimensions");
  Settings disc = strip(4, 4);
  disc.mesh.shape = MeshShape::disc;
  EXPECT_EQ(error_of(disc),
            "mesh: periodic along y: the mesh has no two opposite flat sides, it must fill a box from side to side");
  Settings held = strip(8, 4);
  held.boundary_conditions = {condition(2, BoundaryKind::fixed)};
  EXPECT_EQ(error_of(held), "boundary condition: the mesh has no boundary id 2, it has 0 1 (periodic sides are no boundary)");
}
