// SPDX-License-Identifier: GPL-2.0-or-later
// Springs to the places that a random packing fluctuates to about the smooth field, in two and three dimensions.
#include "coupler/base/mesh_geometry.h"
#include "coupler/method/constraint/penalty_constraint.h"
#include "dem_side/bond_network/network_operator.h"
#include "tests/support/dummy_particles.h"
#include "tests/support/strip_patch.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <numeric>

using namespace kerf;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using test::Body;
using test::Direction;

namespace
{
constexpr double d = 1e-3; // mean diameter [m]

/// A strip across which space repeats itself, particles on its left side.
Case strip_of(int dim, const std::string &kind, int region, int overlap, int fem, int high)
{
  Case settings = test::lattice_rock(d);
  const double edge = kind == "fcc" ? 3. * std::sqrt(2.) * d : 4. * d;
  settings.body.mesh.upper = edge * Vector3d(region + overlap + fem, high, dim == 3 ? high : 0.);
  settings.body.mesh.cell_size = edge;
  settings.body.mesh.periodic = {{false, true, dim == 3}};
  settings.packing.dim = settings.body.dim = dim;
  settings.packing.kind = kind;
  settings.packing.radius_spread = kind == "random" ? 0.4 : 0.;
  settings.packing.upper = settings.body.mesh.upper;
  settings.packing.periodic = settings.body.mesh.periodic;
  settings.overlap.width = overlap * edge;
  settings.fixed_region.push_back({Vector3d(0., -1., -1.), Vector3d(region * edge, 1., 1.)});
  settings.constraint.penalty_ratio = 0.5;
  settings.constraint.corrector = true;
  return settings;
}

/// A strip with its springs, on all ranks: particles are dealt out one by one.
struct Springs
{
  explicit Springs(const Case &the_case) : Springs(the_case, dem::generate_packing(the_case.packing)) {}
  Springs(const Case &the_case, const dem::Packing &store)
    : settings(the_case), packing(store), fem(Body::make_fem(settings)),
      overlap(fem->mesh(), fem->quadrature_points(), fem->surface_positions(), packing, WeightFunction::linear,
              settings.overlap.width)
  {
    overlap.convert(cells_inside(fem->mesh(), settings.fixed_region));
    fem->set_weights(overlap.fe_weights(), overlap.fe_surface_weights());
    constraint = make_constraint(constraint_model(settings, packing, MPI_COMM_WORLD));
    constraint->set_time_step(1e-7);
    constraint->set_particles(overlap.tied_particles());
    int rank = 0, n_ranks = 1;
    MPI_Comm_rank(MPI_COMM_WORLD, &rank);
    MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
    for (int i = rank; i < packing.size(); i += n_ranks)
      local.push_back(i);
  }

  struct Forces
  {
    Matrix3Xd particles, nodes; ///< by index; of all ranks
    double energy = 0.;
  };
  /// For displacements of particles and nodes.
  Forces at(const Matrix3Xd &of_particles, const Matrix3Xd &of_nodes)
  {
    test::DummyParticles particles((packing.positions + of_particles)(Eigen::all, local), 2.);
    particles.index = local;
    dem::Particles view = particles.view();
    fem->set_state(of_nodes, Matrix3Xd::Zero(3, of_nodes.cols()));
    fem->compute_forces();
    const Matrix3Xd before = fem->gather(fem::NodalField::force);
    constraint->apply(dem::Phase::step, view, *fem);
    Forces result;
    result.nodes = fem->gather(fem::NodalField::force) - before;
    result.particles = Matrix3Xd::Zero(3, packing.size());
    result.particles(Eigen::all, local) = particles.f;
    result.energy = constraint->energy().stored;
    MPI_Allreduce(MPI_IN_PLACE, result.particles.data(), static_cast<int>(result.particles.size()), MPI_DOUBLE, MPI_SUM,
                  MPI_COMM_WORLD);
    MPI_Allreduce(MPI_IN_PLACE, &result.energy, 1, MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return result;
  }
  /// Stiffness by index.
  Eigen::VectorXd stiffness() const
  {
    Eigen::VectorXd result = Eigen::VectorXd::Zero(packing.size());
    result(local) = constraint->springs();
    MPI_Allreduce(MPI_IN_PLACE, result.data(), packing.size(), MPI_DOUBLE, MPI_SUM, MPI_COMM_WORLD);
    return result;
  }

  /// Something different everywhere, the same on both sides of the strip.
  Matrix3Xd noise(const Matrix3Xd &points, double amplitude) const
  {
    const Vector3d wave =
      2. * M_PI * settings.body.mesh.upper.cwiseInverse().unaryExpr([](double k) { return std::isfinite(k) ? k : 0.; });
    Matrix3Xd result(3, points.cols());
    for (int k = 0; k < points.cols(); ++k)
    {
      const double x = wave[0] * points(0, k), y = wave[1] * points(1, k), z = wave[2] * points(2, k);
      result.col(k) = amplitude * Vector3d(std::sin(5. * x + y) + std::cos(2. * z), std::cos(3. * x - 2. * y + z),
                                           packing.dim == 3 ? std::sin(4. * x + y - z) : 0.);
    }
    return result;
  }

  Case settings;
  dem::Packing packing;
  std::unique_ptr<fem::FemSide> fem;
  Overlap overlap;
  std::unique_ptr<Constraint> constraint;
  std::vector<int> local;
};

Case random_strip(int dim)
{
  return dim == 2 ? strip_of(2, "random", 2, 3, 2, 3) : strip_of(3, "random", 1, 2, 1, 2);
}

/// A block that ends at its sides, strained and turned by a large angle.
struct TurnedBlock : Springs
{
  explicit TurnedBlock(int dim) : Springs(with_sides(random_strip(dim)))
  {
    turn = Eigen::AngleAxisd(1., dim == 2 ? Vector3d::UnitZ() : Vector3d(1., -2., 1.5).normalized()).toRotationMatrix();
    const Matrix3Xd &X = fem->mesh().nodes;
    u = turn * (X + noise(X, 3e-6)) - X; // strains of some 1e-3
    std::vector<dem::NewParticle> particles(packing.size());
    const std::vector<fem::Interpolation> found = fem->locate(packing.positions);
    for (int i = 0; i < packing.size(); ++i)
    {
      particles[i].index = i;
      for (int a = 0; a < found[i].n; ++a)
        particles[i].displacement += found[i].N[a] * u.col(found[i].nodes[a]);
    }
    smooth.resize(3, packing.size());
    for (int i = 0; i < packing.size(); ++i)
      smooth.col(i) = particles[i].displacement;
    fem->set_state(u, Matrix3Xd::Zero(3, u.cols()));
    constraint->place(particles, *fem);
    placed = smooth;
    for (int i = 0; i < packing.size(); ++i)
      placed.col(i) = particles[i].displacement;
  }
  static Case with_sides(Case settings)
  {
    settings.body.mesh.periodic = settings.packing.periodic = {{false, false, false}};
    return settings;
  }

  Eigen::Matrix3d turn;
  Matrix3Xd u, smooth, placed; ///< displacements of nodes, and of particles by them and where they belong
};
} // namespace

class Corrected : public testing::TestWithParam<int>
{
};
INSTANTIATE_TEST_SUITE_P(Dimensions, Corrected, testing::Values(2, 3));

// Forces are those of whole rows P about the body at rest, k P^T chi with chi = u_i - P u: half the difference of two states
// has no terms of second order of the strains of 1e-4.
TEST_P(Corrected, ForcesAreThoseOfTheRows)
{
  Springs springs(random_strip(GetParam()));
  const Matrix3Xd u = springs.noise(springs.fem->mesh().nodes, 1e-7), x = springs.noise(springs.packing.positions, 3e-7);
  const auto plus = springs.at(x, u), minus = springs.at(-x, -u);

  const auto fluctuations =
    std::make_shared<Fluctuations>(springs.packing, springs.settings.bond.k_n, springs.settings.bond.k_t, *springs.fem);
  Corrector corrector(springs.packing, fluctuations, *springs.fem);
  corrector.set_masses(springs.fem->gather(fem::NodalField::mass).row(0));
  std::vector<int> tied;
  for (const TiedParticle &particle : springs.overlap.tied_particles())
    tied.push_back(particle.index);
  const std::vector<Corrector::Row> rows = corrector.rows(tied);
  const Eigen::VectorXd k = springs.stiffness();
  Matrix3Xd on_particles = Matrix3Xd::Zero(3, springs.packing.size()), on_nodes = Matrix3Xd::Zero(3, u.cols());
  double affine = 0.; // what the fluctuations change
  for (std::size_t t = 0; t < tied.size(); ++t)
  {
    Vector3d chi = x.col(tied[t]);
    for (std::size_t b = 0; b < rows[t].node.size(); ++b)
      chi -= rows[t].P[b] * u.col(rows[t].node[b]);
    const Vector3d pull = k[tied[t]] * chi;
    on_particles.col(tied[t]) = -pull;
    for (std::size_t b = 0; b < rows[t].node.size(); ++b)
    {
      on_nodes.col(rows[t].node[b]) += rows[t].P[b].transpose() * pull;
      affine += std::abs(rows[t].P[b](0, 1));
    }
  }
  EXPECT_GT(affine, 0.02 * tied.size());
  EXPECT_GT(on_nodes.norm(), 0.1 * on_particles.norm());
  EXPECT_LT((0.5 * (plus.particles - minus.particles) - on_particles).norm(), 1e-7 * on_particles.norm());
  EXPECT_LT((0.5 * (plus.nodes - minus.nodes) - on_nodes).norm(), 1e-7 * on_nodes.norm());
}

// A front that moves takes the mass of nodes away: springs and strains are those of springs that never knew them.
TEST_P(Corrected, FollowsTheMasses)
{
  Springs springs(random_strip(GetParam()));
  const Matrix3Xd u = springs.noise(springs.fem->mesh().nodes, 1e-7), x = springs.noise(springs.packing.positions, 3e-7);
  springs.at(x, u);
  const Eigen::VectorXd before = springs.stiffness();
  Vector3d &front = springs.settings.fixed_region[0].upper;
  front[0] += springs.settings.body.mesh.cell_size;
  springs.overlap.convert(cells_inside(springs.fem->mesh(), springs.settings.fixed_region));
  springs.fem->set_weights(springs.overlap.fe_weights(), springs.overlap.fe_surface_weights());
  springs.constraint->set_particles(springs.overlap.tied_particles());
  const auto moved = springs.at(x, u);
  const Eigen::VectorXd after = springs.stiffness();
  springs.constraint = make_constraint(constraint_model(springs.settings, springs.packing, MPI_COMM_WORLD));
  springs.constraint->set_time_step(1e-7);
  springs.constraint->set_particles(springs.overlap.tied_particles());
  const auto added = springs.at(x, u);
  EXPECT_GT((after - before).norm(), 0.1 * before.norm());
  EXPECT_LT((after - springs.stiffness()).norm(), 1e-13 * after.norm());
  EXPECT_LT((moved.particles - added.particles).norm(), 1e-12 * added.particles.norm());
  EXPECT_LT((moved.nodes - added.nodes).norm(), 1e-12 * added.nodes.norm());
}

// Particles that were put where they belong feel nothing, however the rock has turned.
TEST_P(Corrected, PlacesTurnWithTheRock)
{
  TurnedBlock block(GetParam());
  EXPECT_GT((block.placed - block.smooth).norm(), 1e-4 * d * std::sqrt(block.packing.size()));
  const auto smooth = block.at(block.smooth, block.u), placed = block.at(block.placed, block.u);
  EXPECT_LT(placed.energy, 1e-16 * smooth.energy);
  EXPECT_LT(placed.particles.norm(), 1e-8 * smooth.particles.norm());
  EXPECT_LT(placed.nodes.norm(), 1e-8 * smooth.nodes.norm());
}

// Forces are the gradient of the energy in any orientation, and so leave no force and no moment on the whole.
TEST_P(Corrected, ForcesAreTheGradientOfTheEnergy)
{
  TurnedBlock block(GetParam());
  const Matrix3Xd x = block.placed + block.noise(block.packing.positions, 2e-6);
  const auto here = block.at(x, block.u);
  const Matrix3Xd along_x = block.noise(block.packing.positions, 1.) + block.noise(2. * block.packing.positions, 1.),
                  along_u = block.noise(block.fem->mesh().nodes, 1.);
  const double step = 1e-8; // strains of 1e-5, a thousandth of the state
  const double slope = (block.at(x + step * along_x, block.u + step * along_u).energy -
                        block.at(x - step * along_x, block.u - step * along_u).energy) /
                       (2. * step);
  const double power = here.particles.cwiseProduct(along_x).sum() + here.nodes.cwiseProduct(along_u).sum();
  const double scale = here.particles.norm() * along_x.norm();
  EXPECT_GT(std::abs(power), 1e-4 * scale);
  EXPECT_NEAR(slope, -power, 1e-6 * scale);
  // The nodes alone.
  const double of_nodes =
    (block.at(x, block.u + step * along_u).energy - block.at(x, block.u - step * along_u).energy) / (2. * step);
  EXPECT_NEAR(of_nodes, -here.nodes.cwiseProduct(along_u).sum(), 1e-6 * here.nodes.norm() * along_u.norm());

  Vector3d force = here.particles.rowwise().sum() + here.nodes.rowwise().sum(), moment = Vector3d::Zero();
  for (int i = 0; i < x.cols(); ++i)
    moment += Vector3d(block.packing.positions.col(i) + x.col(i)).cross(Vector3d(here.particles.col(i)));
  for (int a = 0; a < block.u.cols(); ++a)
    moment += Vector3d(block.fem->mesh().nodes.col(a) + block.u.col(a)).cross(Vector3d(here.nodes.col(a)));
  EXPECT_LT(force.norm(), 1e-12 * here.particles.norm());
  EXPECT_LT(moment.norm(), 1e-12 * here.particles.norm() * block.settings.body.mesh.upper[0]);
}

// The fluctuations of a packing: means around nodes vanish, and what bonds do against any of them is nothing.
TEST_P(Corrected, FluctuationsAreAtRest)
{
  const Case settings = random_strip(GetParam());
  const int dim = GetParam(), n_strains = dim == 2 ? 3 : 6, n_dofs = dim == 2 ? 3 : 6;
  const dem::Packing packing = dem::generate_packing(settings.packing);
  const auto fem = Body::make_fem(settings);
  const Fluctuations fluctuations(packing, settings.bond.k_n, settings.bond.k_t, *fem);
  Eigen::MatrixXd C(n_dofs * packing.size(), n_strains), at_rest = C;
  for (int i = 0; i < packing.size(); ++i)
    for (int c = 0; c < n_dofs; ++c)
      for (int s = 0; s < n_strains; ++s)
        C(n_dofs * i + c, s) = fluctuations.of(i, c, s);
  std::vector<int> all(packing.size());
  std::iota(all.begin(), all.end(), 0);
  const dem::StoredBonds bonds(packing);
  const dem::NetworkOperator network(packing, bonds, {settings.bond.k_n, settings.bond.k_t, 1.}, all,
                                     std::vector<char>(packing.size(), 1), Eigen::VectorXd::Ones(packing.size()));
  const int axes[6][2] = {{0, 0}, {1, 1}, {dim == 2 ? 0 : 2, dim == 2 ? 1 : 2}, {1, 2}, {0, 2}, {0, 1}};
  Eigen::MatrixXd load = Eigen::MatrixXd::Zero(C.rows(), n_strains), force = load;
  for (int s = 0; s < n_strains; ++s)
  {
    Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
    strain(axes[s][0], axes[s][1]) += 0.5;
    strain(axes[s][1], axes[s][0]) += 0.5;
    network.add_homogeneous(strain, load.col(s));
    force.col(s) = load.col(s);
    network.add_product(C.col(s), force.col(s));
  }
  const Eigen::MatrixXd released = -C.transpose() * load; // twice the energy that the fluctuations give back
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(released).eigenvalues()[0], 0.);
  EXPECT_LT((C.transpose() * force).norm(), 1e-6 * released.norm());

  const std::vector<fem::Interpolation> found = fem->locate(packing.positions);
  Eigen::MatrixXd means = Eigen::MatrixXd::Zero(dim * fem->mesh().n_nodes(), n_strains), sizes = means;
  for (int i = 0; i < packing.size(); ++i)
    for (int a = 0; a < found[i].n; ++a)
      for (int c = 0; c < dim; ++c)
      {
        const Eigen::RowVectorXd part = found[i].N[a] * packing.volume(i) * C.row(n_dofs * i + c);
        means.row(dim * found[i].nodes[a] + c) += part;
        sizes.row(dim * found[i].nodes[a] + c) += part.cwiseAbs();
      }
  EXPECT_LT(means.norm(), 1e-6 * sizes.norm());
}

// A lattice has no fluctuations: the springs are those of the smooth field.
TEST(CorrectedLattice, IsNotCorrected)
{
  Case settings = strip_of(3, "fcc", 1, 2, 1, 2);
  settings.packing.lattice = {0, 0.};
  dem::Packing packing = dem::generate_packing(settings.packing);
  // Joined at its ends, where the lattice would fluctuate.
  settings.body.mesh.periodic = {{true, true, true}};
  packing.periodic = settings.body.mesh.upper;
  dem::bond_by_gap(packing, packing.gap_tolerance);
  Springs corrected(settings, packing);
  settings.constraint.corrector = false;
  Springs affine(settings, packing);
  const Matrix3Xd u = affine.noise(affine.fem->mesh().nodes, 1e-6), x = affine.noise(affine.packing.positions, 3e-6);
  const auto with = corrected.at(x, u), without = affine.at(x, u);
  // Stiffnesses follow the rows' masses, which have no fluctuations either.
  EXPECT_GT(without.particles.norm(), 0.);
  EXPECT_LT((with.particles - without.particles).norm(), 1e-9 * without.particles.norm());
  EXPECT_LT((with.nodes - without.nodes).norm(), 1e-9 * without.nodes.norm());
}

// In space a random packing is less affine than in the plane: springs of 4 k_n to the smooth field make the overlap several
// per cent too stiff, with the corrector they do not.
TEST(CorrectedPatch, KeepsTheModulusInSpace)
{
  int n_ranks = 1;
  MPI_Comm_size(MPI_COMM_WORLD, &n_ranks);
  if (n_ranks > 1)
    GTEST_SKIP() << "long enough on one rank";
  constexpr double duration = 0.9e-4; // ten passages of a P wave
  Case settings = strip_of(3, "random", 4, 3, 1, 2);
  const dem::Packing packing = dem::generate_packing(settings.packing);
  const dem::ElasticCalibration bonds =
    dem::calibrate_elastic(packing, settings.body.material.young, settings.body.material.poisson);
  settings.bond.k_n = bonds.k_n;
  settings.bond.k_t = bonds.k_t;
  settings.activation.relaxation_steps = 15;
  settings.local_damping = 0.4;
  settings.constraint.method = "penalty";
  settings.constraint.penalty_ratio = 1.;
  test::hold_ends(settings);
  const test::Flexibilities parts = test::flexibilities(settings, packing, Direction::shear, duration);
  double energy[2];
  for (const bool corrector : {false, true})
  {
    settings.constraint.corrector = corrector;
    const test::PatchErrors errors = test::patch_errors(settings, packing, parts, Direction::shear, duration);
    std::cout << "[ packing  ] " << (corrector ? "corrected" : "affine") << ": strain " << 100. * errors.strain
              << " %, overlap energy " << 100. * errors.energy << " %" << std::endl;
    energy[corrector] = errors.energy;
  }
  EXPECT_GT(energy[0], energy[1] + 0.02);
  EXPECT_LT(std::abs(energy[1]), 0.02);
}
