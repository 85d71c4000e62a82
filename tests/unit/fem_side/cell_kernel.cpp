// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_cell_mesh.h"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

using namespace kerf::fem;
using namespace kerf::fem::test;

namespace
{
constexpr double h = 0.05;

template <int dim>
using Nodal = typename CellMesh<dim>::Nodal;
template <int dim>
using Tensor = Eigen::Matrix<double, dim, dim>;

/// 5 x 4 (x 3) cells: not a multiple of the lanes of any host. Flat, so that directions differ.
template <int dim>
CellMesh<dim> block()
{
  q1::Point<dim> size = q1::Point<dim>::Constant(h);
  size[1] *= 0.6;
  return CellMesh<dim>(Eigen::Vector3i(5, 4, 3).head<dim>(), size);
}

template <int dim>
Tensor<dim> gradient()
{
  Eigen::Matrix3d H;
  H << 0.9, -0.6, 0.2, 0.4, -0.7, -0.3, 0.1, 0.5, 0.8;
  return H.topLeftCorner<dim, dim>();
}

template <int dim>
Tensor<dim> turn(const double angle)
{
  Eigen::Matrix3d R = Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  if (dim == 3)
    R = Eigen::AngleAxisd(0.4 * angle, Eigen::Vector3d::UnitX()).toRotationMatrix() * R;
  return R.topLeftCorner<dim, dim>();
}

template <typename Derived>
double largest(const Eigen::MatrixBase<Derived> &values)
{
  return values.cwiseAbs().maxCoeff();
}

template <int dim>
double force_scale()
{
  return rock().young * std::pow(h, dim - 1);
}

const char *name_of(const Strain strain)
{
  return strain == Strain::finite ? "finite" : "small";
}
const char *name_of(const Integration integration)
{
  return integration == Integration::full ? "full" : integration == Integration::selective ? "selective" : "one_point";
}
constexpr Integration all_integrations[] = {Integration::full, Integration::selective, Integration::one_point};

/// Runs a generic lambda with the dimension as a constant.
template <typename Check>
void in_plane_and_space(const Check &check)
{
  check(std::integral_constant<int, 2>());
  check(std::integral_constant<int, 3>());
}

class FemKernel : public ::testing::TestWithParam<std::tuple<Strain, Integration>>
{
protected:
  Strain strain() const { return std::get<0>(GetParam()); }
  Integration integration() const { return std::get<1>(GetParam()); }
};
class FiniteKernel : public ::testing::TestWithParam<Integration>
{
};
} // namespace

INSTANTIATE_TEST_SUITE_P(
  All, FemKernel, ::testing::Combine(::testing::Values(Strain::finite, Strain::small), ::testing::ValuesIn(all_integrations)),
  [](const auto &info) { return std::string(name_of(std::get<0>(info.param))) + "_" + name_of(std::get<1>(info.param)); });

INSTANTIATE_TEST_SUITE_P(All, FiniteKernel, ::testing::ValuesIn(all_integrations));

// Linear fields are in the space of the element and integrated exactly, so only round-off is left.
TEST_P(FemKernel, PatchTestOnDistortedCells)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      CellMesh<dim> mesh = block<dim>();
      mesh.distort(0.15 * h);
      const auto kernel = mesh.kernel(strain(), integration());
      for (const double size : {1e-3, 0.2})
      {
        const Nodal<dim> f = mesh.forces(kernel, size * gradient<dim>() * mesh.X);
        for (int i = 0; i < mesh.X.cols(); ++i)
          if (mesh.inside(i))
          {
            EXPECT_LT(f.col(i).norm(), 1e-12 * force_scale<dim>()) << dim << ' ' << i;
          }
        EXPECT_GT(f.norm(), 0.1 * size * force_scale<dim>());
      }
    });
}

// Uniform stress: whatever the integration, nodal forces are the weighted integral of the gradients of the shape functions.
TEST_P(FemKernel, UniformStressActsAlikeUnderAnyWeights)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const bool distorted : {false, true})
      {
        CellMesh<dim> mesh = block<dim>();
        if (distorted)
          mesh.distort(0.15 * h);
        mesh.uneven_weights();
        mesh.alpha.front().fill(1.);
        const Nodal<dim> u = 0.1 * gradient<dim>() * mesh.X;
        const Nodal<dim> f = mesh.forces(mesh.kernel(strain(), integration()), u);
        const Nodal<dim> full = mesh.forces(mesh.kernel(strain(), Integration::full), u);
        EXPECT_LT(largest(f - full), 1e-12 * force_scale<dim>()) << dim << distorted;
      }
    });
}

TEST_P(FemKernel, RigidMotionGivesNoForce)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      CellMesh<dim> mesh = block<dim>();
      mesh.distort(0.15 * h);
      const auto kernel = mesh.kernel(strain(), integration());
      Nodal<dim> u = Nodal<dim>::Constant(dim, mesh.X.cols(), 0.7);
      EXPECT_LT(largest(mesh.forces(kernel, u)), 1e-12 * force_scale<dim>());
      if (strain() == Strain::finite)
        u += (turn<dim>(0.5 * M_PI) - Tensor<dim>::Identity()) * mesh.X; // by 90 degrees
      else
      {
        const Tensor<dim> spin = gradient<dim>() - gradient<dim>().transpose();
        u += spin * mesh.X;
      }
      EXPECT_LT(largest(mesh.forces(kernel, u)), 1e-12 * force_scale<dim>());
      EXPECT_LT(kernel.elastic_energy(u.data()), 1e-20 * rock().young * std::pow(h, dim));
    });
}

// Central differences of a polynomial of degree 4 in the displacements: 1e-7 with this step, exact for small strain.
TEST_P(FemKernel, ForceIsMinusDerivativeOfEnergy)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const bool distorted : {false, true})
        for (const bool weighted : {false, true})
        {
          CellMesh<dim> mesh = block<dim>();
          if (distorted)
            mesh.distort(0.15 * h);
          if (weighted)
            mesh.uneven_weights();
          const auto kernel = mesh.kernel(strain(), integration());
          const Nodal<dim> u = turn<dim>(0.3) * mesh.X - mesh.X + mesh.noise(0.05 * h, 1);
          const Nodal<dim> direction = mesh.noise(h, 2);
          const Nodal<dim> f = mesh.forces(kernel, u);
          const double step = 1e-5;
          const Nodal<dim> above = u + step * direction, below = u - step * direction;
          const double expected = -(kernel.elastic_energy(above.data()) - kernel.elastic_energy(below.data())) / (2. * step);
          EXPECT_NEAR(f.cwiseProduct(direction).sum(), expected, 1e-7 * f.norm() * direction.norm())
            << dim << distorted << weighted;
        }
    });
}

// Forces of a strained and turned body are the turned forces.
TEST_P(FiniteKernel, IsObjective)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const bool distorted : {false, true})
      {
        CellMesh<dim> mesh = block<dim>();
        if (distorted)
          mesh.distort(0.15 * h);
        const auto kernel = mesh.kernel(Strain::finite, GetParam());
        const Nodal<dim> u = mesh.noise(0.05 * h, 5);
        const Tensor<dim> R = turn<dim>(2.1);
        const Nodal<dim> turned = R * (mesh.X + u) - mesh.X;
        EXPECT_LT(largest(mesh.forces(kernel, turned) - R * mesh.forces(kernel, u)), 1e-12 * force_scale<dim>());
      }
    });
}

// Cells with edges along the axes have shortcuts. A turned block has none, but must give the turned forces of an isotropic
// solid.
TEST_P(FemKernel, ShortcutsOfBoxesChangeNothing)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const bool weighted : {false, true})
      {
        CellMesh<dim> mesh = block<dim>();
        if (weighted)
          mesh.uneven_weights();
        CellMesh<dim> turned = mesh;
        const Tensor<dim> R = turn<dim>(0.6);
        turned.X = R * mesh.X;
        const Nodal<dim> u = mesh.noise(0.05 * h, 6);
        const auto kernel = mesh.kernel(strain(), integration()), turned_kernel = turned.kernel(strain(), integration());
        const Nodal<dim> f = mesh.forces(kernel, u);
        EXPECT_LT(largest(turned.forces(turned_kernel, R * u) - R * f), 1e-12 * force_scale<dim>()) << dim << weighted;
        const Nodal<dim> turned_u = R * u;
        const double energy = kernel.elastic_energy(u.data());
        EXPECT_NEAR(turned_kernel.elastic_energy(turned_u.data()), energy, 1e-12 * energy) << dim << weighted;
      }
    });
}

// A cell resists everything but rigid motions: 3 zero eigenvalues in the plane, 6 in space, and no other small ones
// (hourglass modes). Distorted cells and uneven weights too.
TEST_P(FemKernel, OnlyRigidMotionsAreFree)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const bool distorted : {false, true})
      {
        CellMesh<dim> mesh(CellMesh<dim>::Index::Ones(), q1::Point<dim>::Constant(h));
        if (distorted)
        {
          mesh.X += mesh.noise(0.15 * h, 8);
          mesh.uneven_weights();
        }
        const Eigen::MatrixXd K = mesh.stiffness(mesh.kernel(strain(), integration()));
        EXPECT_LT(largest(K - K.transpose()), 1e-13 * largest(K));
        const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(K).eigenvalues();
        const int n_rigid = dim == 2 ? 3 : 6;
        const double top = eigenvalues[eigenvalues.size() - 1];
        EXPECT_LT(std::abs(eigenvalues[n_rigid - 1]), 1e-12 * top) << dim << distorted;
        EXPECT_GT(eigenvalues[n_rigid], 0.02 * top) << dim << distorted;
      }
    });
}

// The rest of the expansion is quadratic in the displacement: strains of 1e-7 and a smallness of 1e-6.
TEST_P(FemKernel, LinearForcesAreTheLimitOfSmallDisplacements)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      CellMesh<dim> mesh = block<dim>();
      mesh.distort(0.15 * h);
      const auto kernel = mesh.kernel(strain(), integration());
      const Nodal<dim> u = mesh.noise(1e-7 * h, 9);
      Nodal<dim> linear = Nodal<dim>::Zero(dim, mesh.X.cols());
      kernel.subtract_linear_forces(u.data(), linear.data());
      const Nodal<dim> f = mesh.forces(kernel, u);
      EXPECT_LT(largest(f - linear), (strain() == Strain::small ? 1e-15 : 1e-6) * largest(f));
    });
}

// Cells side by side in one batch do not see each other, however many lanes are left over.
TEST_P(FemKernel, BatchesAreSumsOfCells)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension;
      for (const int n_cells : {1, 2, n_lanes, n_lanes + 1})
      {
        typename CellMesh<dim>::Index extent = CellMesh<dim>::Index::Ones();
        extent[0] = n_cells;
        CellMesh<dim> mesh(extent, q1::Point<dim>::Constant(h));
        mesh.X += mesh.noise(0.1 * h, 4);
        const Nodal<dim> u = mesh.noise(0.05 * h, 7);
        Nodal<dim> sum = Nodal<dim>::Zero(dim, mesh.X.cols());
        double energy = 0.;
        for (int c = 0; c < n_cells; ++c)
        {
          CellMesh<dim> alone = mesh;
          alone.cells = {mesh.cells[c]};
          alone.alpha = {mesh.alpha[c]};
          const auto kernel = alone.kernel(strain(), integration());
          sum += alone.forces(kernel, u);
          energy += kernel.elastic_energy(u.data());
        }
        const auto kernel = mesh.kernel(strain(), integration());
        EXPECT_EQ(kernel.n_cells(), n_cells);
        EXPECT_LT(largest(mesh.forces(kernel, u) - sum), 1e-15 * force_scale<dim>());
        EXPECT_NEAR(kernel.elastic_energy(u.data()), energy, 1e-14 * energy);
      }
    });
}

// Cells around a node may be worked on together. Apart from round-off that must not show: neither in a structured mesh of odd
// numbers of cells, nor with holes, varying weights, turned cells in any order, nodes of their own and periodic ends. Cells of
// the same colour share no nodes.
TEST_P(FemKernel, NeighboursAreSumsOfCells)
{
  in_plane_and_space(
    [&](const auto dimension)
    {
      constexpr int dim = dimension, n = q1::n_nodes<dim>;
      for (int variant = 0; variant < 64; ++variant)
      {
        const bool distorted = variant & 1, weighted = variant & 2, holes = variant & 4, turned = variant & 8,
                   periodic = variant & 16, copies = variant & 32;
        typename CellMesh<dim>::Index extent = CellMesh<dim>::Index::Constant(dim == 2 ? 14 : 6);
        extent[1] += 1;
        CellMesh<dim> mesh(extent, q1::Point<dim>::Constant(h));
        mesh.X.row(0) += mesh.X.row(0).cwiseAbs2() / (20. * h); // graded
        if (distorted)
          mesh.distort(0.15 * h);
        const int n_nodes = mesh.X.cols(), n_cells = mesh.cells.size();
        const Nodal<dim> u = mesh.noise(0.05 * h, 7);

        std::vector<std::array<int, n>> dofs(n_cells);
        std::vector<q1::NodalValues<dim>> X(n_cells);
        std::vector<int> colour(n_cells), order;
        for (int c = 0; c < n_cells; ++c)
        {
          const auto index = CellMesh<dim>::index_of(c, extent);
          for (int d = 0; d < dim; ++d)
            colour[c] |= (index[d] & 1) << d;
          for (int a = 0; a < n; ++a)
          {
            // Turned by 90 degrees about the last axis, see q1_cell.h.
            const int corner = turned && c % 6 == 0 ? (a & 4) | "\1\3\0\2"[a & 3] : a;
            int node = mesh.cells[c][corner];
            X[c].col(a) = mesh.X.col(node);
            if (copies && c % 7 == 0 && a == 1)
              node = (node + n_nodes / 2) % n_nodes; // whichever, only its number counts
            else if (periodic && index[0] == extent[0] - 1 && (corner & 1))
              node -= extent[0];
            dofs[c][a] = dim * node;
          }
          if (weighted)
            for (int q = 0; q < n; ++q)
              mesh.alpha[c][q] = 0.6 + 0.3 * noise(c % 5 == 0 ? n * c + q : c);
          if (!holes || c % 11 != 3)
            order.push_back(c);
        }
        if (turned)
          std::reverse(order.begin() + order.size() / 2, order.end());

        const auto result = [&](const auto &chosen, double &energy, const bool use_early)
        {
          CellKernel<dim> kernel(rock(), strain(), integration());
          for (const int c : order)
          {
            if (chosen(c))
              kernel.add_cell(dofs[c], X[c], mesh.alpha[c]);
            if (use_early && c == order[order.size() / 2])
              kernel.elastic_energy(u.data()); // more cells may follow
          }
          energy += kernel.elastic_energy(u.data());
          return mesh.forces(kernel, u);
        };
        double energy = 0., early_energy = 0., sum_of_energies = 0.;
        const Nodal<dim> f = result([](int) { return true; }, energy, false);
        const Nodal<dim> early = result([](int) { return true; }, early_energy, true);
        Nodal<dim> sum = Nodal<dim>::Zero(dim, n_nodes);
        for (int k = 0; k < n; ++k)
          sum += result([&](const int c) { return colour[c] == k; }, sum_of_energies, false);
        EXPECT_LT(largest(f - sum), 1e-12 * largest(sum)) << dim << ' ' << variant;
        EXPECT_LT(largest(early - sum), 1e-12 * largest(sum)) << dim << ' ' << variant;
        EXPECT_NEAR(energy, sum_of_energies, 1e-12 * energy) << dim << ' ' << variant;
        EXPECT_NEAR(early_energy, sum_of_energies, 1e-12 * energy) << dim << ' ' << variant;
      }
    });
}

TEST(FindPatches, StructuredMeshesArePatchesButForOddCells)
{
  in_plane_and_space(
    [](const auto dimension)
    {
      constexpr int dim = dimension;
      typename CellMesh<dim>::Index extent = CellMesh<dim>::Index::Constant(6);
      extent[1] = 7;
      const CellMesh<dim> mesh(extent, q1::Point<dim>::Constant(h));
      std::vector<NumberedCell<dim>> cells(mesh.cells.size());
      for (std::size_t c = 0; c < cells.size(); ++c)
        for (int a = 0; a < q1::n_nodes<dim>; ++a)
        {
          cells[c].node[a] = mesh.cells[c][a];
          cells[c].X.col(a) = mesh.X.col(mesh.cells[c][a]);
        }
      const auto n_patches = [&] { return find_patches<dim>(cells, mesh.X.cols()).size(); };
      EXPECT_EQ(n_patches(), dim == 2 ? 9u : 27u);
      cells[0].X(0, 1) += h; // another place, as across the ends of a periodic mesh
      EXPECT_EQ(n_patches(), dim == 2 ? 8u : 26u);
    });
}
