// SPDX-License-Identifier: GPL-2.0-or-later
// Changes of models both ways: what they add, and that they can be repeated.
#include "coupler/base/mesh_geometry.h"
#include "tests/support/plane_packet.h"
#include "tests/support/strip_front.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include <Eigen/SparseCholesky>

using namespace kerf;
using Eigen::Vector3d;
using test::Body;
using test::Direction;
using test::Strip;
using test::StripCase;

namespace
{
/// Columns of cells next to the front of a strip: the last ones of the particle region, or the first ones beyond it.
std::vector<int> columns_at_front(Body &body, const Strip &shape, int n, bool inside)
{
  const double front = shape.region_end(), width = n * shape.cell_length();
  std::vector<int> cells;
  for (int cell = 0; cell < body.fem->mesh().n_cells(); ++cell)
    if (const double x = cell_centre(body.fem->mesh(), cell)[0];
        inside ? x > front - width && x < front : x > front && x < front + width)
      cells.push_back(cell);
  return cells;
}

double largest_kinetic(Body &body, int steps)
{
  double largest = 0.;
  for (int k = 0; k < steps; k += 5)
  {
    body.model.advance(5);
    largest = std::max(largest, body.model.energies().kinetic);
  }
  return largest;
}

/// Of a strip under uniaxial strain eps, for the length [J].
double tension_energy(const StripCase &strip, double eps, double length)
{
  return 0.5 * (strip.settings.body.material.lame_lambda() + 2. * strip.settings.body.material.lame_mu()) * eps * eps * length *
         strip.strip.height();
}

StripCase strip_of(bool random)
{
  Strip shape;
  shape.random = random;
  shape.fem = 8;
  shape.high = random ? 5 : 2;
  StripCase strip(shape);
  strip.settings.constraint.method = "weak_multipliers";
  return strip;
}
} // namespace

// A uniform strain is in both models exactly: to the finite elements and back again nothing moves, the audit finds no stress
// jump beyond the terms of second order in the strain (1e-6 of the stress, 1e-12 of Young's modulus), all bonds are accounted
// for, and the recovered nodes are where they were, to the round-off of positions of 0.1 m against displacements of 1e-8 m.
TEST(Changes, UniformLatticeGoesBackAndForth)
{
  constexpr double eps = 1e-6;
  StripCase strip = strip_of(false);
  test::hold_ends(strip.settings);
  Body body(strip.settings, strip.packing, Mode::fixed);
  body.set_state([](const Vector3d &x) { return Vector3d(eps * x[0], 0., 0.); },
                 [](const Vector3d &) { return Vector3d(Vector3d::Zero()); });
  const Eigen::Matrix3Xd u = body.fem->gather(fem::NodalField::displacement);
  body.model.start();
  const int n_active = body.model.dem().n_active();

  const std::vector<int> cells = columns_at_front(body, strip.strip, 2, true);
  const double layer = tension_energy(strip, eps, 2. * strip.strip.cell_length());
  body.model.return_to_continuum(cells);
  EXPECT_LT((body.fem->gather(fem::NodalField::displacement) - u).norm(), 1e-7 * u.norm());
  EXPECT_LT(body.model.dem().n_active(), n_active - 10);
  EXPECT_LT(largest_kinetic(body, 100), 1e-8 * layer);
  body.model.activate(cells);
  EXPECT_EQ(body.model.dem().n_active(), n_active);
  EXPECT_LT(largest_kinetic(body, 100), 1e-8 * layer);

  ASSERT_EQ(body.model.events().size(), 3u);
  for (std::size_t k = 1; k < 3; ++k) // the first one converts the free surface, too, where stresses are not uniform
  {
    const ActivationEvent &event = body.model.events()[k];
    EXPECT_EQ(event.after.bonds - event.before.bonds, event.bonds_stored);
    EXPECT_NEAR(event.stress, eps * strip.settings.body.material.young, 0.2 * eps * strip.settings.body.material.young);
    EXPECT_LT(event.stress_jump, 1e-10 * strip.settings.body.material.young);
  }
  EXPECT_EQ(body.model.events()[1].particles, -body.model.events()[2].particles);
  EXPECT_LT(std::abs(body.model.energies().conversion), 1e-4 * layer);
}

// In a random packing the nodes take the mean of particles that fluctuate: the front goes back with less noise than it comes.
TEST(Changes, RandomPackingGoesBackQuietly)
{
  constexpr double eps = 1e-5;
  StripCase strip = strip_of(true);
  test::hold_ends(strip.settings);
  strip.settings.local_damping = 0.4;
  Body rested(strip.settings, strip.packing, Mode::fixed);
  test::energy_at_rest(rested, Direction::tension, eps * (strip.strip.length() - strip.strip.cell_length()));
  strip.settings.local_damping = 0.;
  Body body(strip.settings, strip.packing, rested.dt);
  test::take_state(body, rested);
  const double layer = tension_energy(strip, eps, 2. * strip.strip.cell_length());
  body.model.return_to_continuum(columns_at_front(body, strip.strip, 2, true));
  const double kinetic = largest_kinetic(body, 150);
  std::cout << "[ return   ] conversion " << 100. * body.model.energies().conversion / layer << " %, kinetic "
            << 100. * kinetic / layer << " % of the layer's energy" << std::endl;
  EXPECT_EQ(body.model.events().back().bonds_born_broken, 0);
  EXPECT_LT(kinetic, 0.02 * layer);
  EXPECT_LT(std::abs(body.model.energies().conversion), 0.10 * layer);
}

// The rule: what is loaded, damaged or has not been quiet for long enough stays, the rest goes back.
TEST(Changes, QuietCellsGoBack)
{
  StripCase strip = strip_of(false);
  strip.settings.activation.sigma_star = 1e6;
  strip.settings.activation.return_fraction = 0.5;
  strip.settings.activation.return_time = 4e-6;
  strip.settings.activation.check_interval = 10;
  strip.settings.bond.R_n = 1e-3 * strip.settings.bond.k_n * Strip::d;
  const auto zero = [](const Vector3d &) { return Vector3d(Vector3d::Zero()); };
  const auto run = [&](bool damaged)
  {
    auto body = std::make_unique<Body>(strip.settings, strip.packing, 5e-8, Mode::adaptive);
    body->set_state(zero, zero);
    body->model.start();
    std::vector<int> cells = cells_inside(body->fem->mesh(), strip.settings.fixed_region);
    body->model.activate(cells);
    if (damaged)
    {
      // A particle of the first column is pulled off its neighbours and put back.
      dem::Particles particles = body->model.dem().particles();
      for (int i = 0; i < particles.n; ++i)
        if (particles.index[i] == 0)
          particles.position(0, i) -= 0.01 * Strip::d;
      body->model.set_up_forces();
    }
    int back_at = -1;
    for (int step = 0; step < 200; step += 10)
    {
      body->model.advance(10);
      if (body->model.adapt() && back_at < 0)
        back_at = step + 10;
    }
    return std::make_pair(std::move(body), back_at);
  };
  const auto [quiet, when] = run(false);
  EXPECT_EQ(quiet->model.dem().n_active(), 0);
  EXPECT_EQ(quiet->model.overlap().n_converted(), 0);
  EXPECT_GE(when * 5e-8, 4e-6 * (1. - 1e-9));
  EXPECT_LE(when * 5e-8, 2. * 4e-6);

  const auto [damaged, later] = run(true);
  EXPECT_GT(damaged->model.dem().n_bonds_broken(), 0);
  EXPECT_GT(damaged->model.dem().n_active(), 0);
  EXPECT_GT(damaged->model.overlap().n_converted(), 0);
  EXPECT_LT(damaged->model.overlap().n_converted(), 40);
  for (const dem::BrokenBond &bond : damaged->model.dem().broken_bonds())
    EXPECT_TRUE(damaged->model.dem().is_active()[bond.first] && damaged->model.dem().is_active()[bond.second]);
}

// An outermost particle of the overlap has come off and has moved by 0.3 d, or has turned by half a radian at its place. When
// the front moves on, its bonds to the new particles are born broken. They would hold k_t (b d 0.5)^2/2 each, four orders more
// than a bond at failure. All else is at rest, so the conversion creates nothing: less than a hundredth of a bond at failure.
// One that flies gets its new mass from finite elements at rest: its momentum stays, its kinetic energy falls with its speed.
TEST(Changes, NoBondsToParticlesThatHaveLeftTheField)
{
  enum State
  {
    moved,
    turned,
    flying
  };
  for (const State state : {moved, turned, flying})
  {
    StripCase strip = strip_of(true);
    dem::BondParameters &bond = strip.settings.bond;
    bond.R_n = 1e-3 * bond.k_n * Strip::d;
    bond.R_t = 0.3 * bond.R_n; // torn off sideways, too
    Body body(strip.settings, strip.packing, Mode::fixed);
    const auto zero = [](const Vector3d &) { return Vector3d(Vector3d::Zero()); };
    body.set_state(zero, zero);
    body.model.start();
    const dem::DemSide &dem = body.model.dem();
    const dem::StoredBonds &bonds = body.model.overlap().bonds();
    const dem::Packing &packing = body.packing;
    const auto n_partners = [&](int i, bool active)
    {
      const auto partners = bonds.partners_of(i);
      return std::count_if(partners.begin(), partners.end(), [&](int j) { return bool(dem.is_active()[j]) == active; });
    };
    // Without weight, and with room to move.
    const Vector3d shift(0.3 * Strip::d, 0., 0.);
    const auto has_room = [&](int i)
    {
      for (int j = 0; j < packing.size(); ++j)
        if (j != i && dem.is_active()[j] &&
            packing.shortest(packing.positions.col(i) + shift - packing.positions.col(j)).norm() <
              packing.radii[i] + packing.radii[j])
          return false;
      return true;
    };
    int loose = -1;
    for (int i = 0; i < packing.size() && loose < 0; ++i)
      if (dem.is_active()[i] && body.model.overlap().de_weights()[i] == 0. && n_partners(i, false) > 1 && has_room(i))
        loose = i;
    ASSERT_GE(loose, 0);
    // All others are where they were, at rest.
    const auto put = [&](const Vector3d &by, double angle)
    {
      body.set_state(zero, zero);
      dem::Particles particles = body.model.dem().particles();
      particles.velocity.setZero();
      particles.angular_velocity.setZero();
      for (int i = 0; i < particles.n; ++i)
      {
        const bool moves = particles.index[i] == loose;
        const double half = moves ? 0.5 * angle : 0.;
        particles.position.col(i) = packing.positions.col(particles.index[i]) + (moves ? by : Vector3d(Vector3d::Zero()));
        Eigen::Map<Eigen::Vector4d>(particles.rotation + 4 * i) << std::cos(half), 0., 0., std::sin(half);
      }
      body.model.set_up_forces();
    };
    const auto n_bonds = n_partners(loose, true);
    put(Vector3d(5e-3 * Strip::d, 0., 0.), 0.);
    body.model.advance(1);
    const std::int64_t broken = dem.n_bonds_broken(); // a neighbour may lose one, too
    const std::vector<dem::BrokenBond> torn = dem.broken_bonds();
    ASSERT_EQ(std::count_if(torn.begin(), torn.end(), [&](const auto &b) { return b.first == loose || b.second == loose; }),
              n_bonds);
    put(state == turned ? Vector3d(Vector3d::Zero()) : shift, state == turned ? 0.5 : 0.);
    const Vector3d velocity(state == flying ? 50. : 0., 0., 0.);
    dem::Particles particles = body.model.dem().particles();
    const auto place = std::find(particles.index, particles.index + particles.n, loose) - particles.index;
    const double mass_before = particles.mass[place];
    particles.velocity.col(place) = velocity;

    const auto expected = n_partners(loose, false);
    body.model.activate(columns_at_front(body, strip.strip, 2, false));
    const ActivationEvent &event = body.model.events().back();
    EXPECT_EQ(event.bonds_born_broken, expected);
    EXPECT_EQ(event.after.bonds - event.before.bonds, event.bonds_stored);
    EXPECT_EQ(dem.n_bonds_broken(), broken + expected);
    const double failure = 0.5 * bond.R_n * bond.R_n / bond.k_n;
    std::cout << "[ left     ] created " << (event.held_after - event.held_before) / failure << " of a bond at failure"
              << std::endl;
    EXPECT_LT(event.held_after - event.held_before, 0.01 * failure);
    if (state != flying)
      continue;
    particles = body.model.dem().particles();
    const auto now = std::find(particles.index, particles.index + particles.n, loose) - particles.index;
    const double slower = mass_before / particles.mass[now];
    EXPECT_LT(slower, 0.5);
    EXPECT_NEAR((particles.velocity.col(now) - slower * velocity).norm(), 0., 1e-12 * velocity.norm());
    EXPECT_NEAR((event.after.momentum - event.before.momentum).norm(), 0., 1e-12 * mass_before * velocity.norm());
    EXPECT_NEAR(event.after.kinetic, slower * event.before.kinetic, 1e-12 * event.before.kinetic);
  }
}

// A wave of 20 diameters is on its way through the front when the front moves towards it by half an overlap: what the change
// brings in or takes out is small against the wave, and the balance closes to the 0.5 % that is asked for.
TEST(Changes, ActivationThroughPassingWave)
{
  for (const int direction : {0, 1})
  {
    StripCase strip = [&]
    {
      Strip shape;
      shape.region = 30;
      shape.fem = 60;
      StripCase result(shape);
      result.settings.constraint.method = "weak_multipliers";
      result.settings.activation.relaxation_steps = 15;
      return result;
    }();
    Body body(strip.settings, strip.packing, Mode::fixed);
    const double wave = 20. * Strip::d;
    const auto at = [&](double k) { return test::cells_wave(strip.settings, k, direction); };
    const double front = strip.strip.region_end();
    const double centre = front + strip.strip.overlap_width() + 4. * wave;
    test::put_on_nodes(body, test::PlanePacket(centre, wave, -1, 1e-6 * Strip::d, at), direction);
    body.model.start();
    const double before = body.model.energies().held();
    const double speed = direction == 0 ? strip.settings.body.material.speed_p() : strip.settings.body.material.speed_s();
    body.model.advance(static_cast<int>((centre - front - strip.strip.overlap_width()) / (speed * body.dt)));
    body.model.activate(columns_at_front(body, strip.strip, 2, false));
    body.model.advance(300);
    const EnergyLedger energy = body.model.energies();
    std::cout << "[ wave     ] conversion " << 100. * energy.conversion / before << " %, interface "
              << 100. * energy.interface / before << " %, residual " << energy.residual() / before << std::endl;
    EXPECT_LT(std::abs(energy.conversion), 0.02 * before);
    EXPECT_LT(std::abs(energy.residual()), 0.005 * before);
  }
}

// Below a concentrated load on a free surface the projected field is wrong at the scale of the cells as well. Moved to rest
// first, less than 6 % of the strain energy starts to move; with plain projection it is several times that.
TEST(Changes, ActivationBelowConcentratedLoad)
{
  constexpr double d = 1e-3, h = 4e-3, load = 1e5;
  Case settings = test::lattice_rock(d);
  settings.body.mesh.upper = Vector3d(18. * h, 12. * h, 0.);
  settings.body.mesh.cell_size = h;
  settings.packing.kind = "random";
  settings.packing.radius_spread = 0.4;
  settings.packing.seed = 1;
  settings.packing.upper = settings.body.mesh.upper;
  settings.overlap.width = 2. * h;
  settings.constraint.fluctuation_relaxation = 0.05;
  settings.constraint.method = "weak_multipliers";
  for (int id = 0; id < 3; ++id)
  {
    fem::BoundaryCondition fixed;
    fixed.id = id;
    fixed.kind = fem::BoundaryKind::fixed;
    settings.body.boundary_conditions.push_back(fixed);
  }
  fem::BoundaryCondition pressed;
  pressed.where = "y > 0.04799 && abs(x - 0.036) < 0.004";
  pressed.kind = fem::BoundaryKind::traction;
  pressed.traction = Vector3d(0., -load, 0.);
  settings.body.boundary_conditions.push_back(pressed);
  const dem::Packing packing = dem::generate_packing(settings.packing);
  const dem::ElasticCalibration bonds =
    dem::calibrate_elastic(packing, settings.body.material.young, settings.body.material.poisson);
  settings.bond.k_n = bonds.k_n;
  settings.bond.k_t = bonds.k_t;

  double kinetic[2];
  for (const int relaxation : {0, 15})
  {
    settings.activation.relaxation_steps = relaxation;
    Body body(settings, packing, 1e-7, Mode::fixed);
    // Static solution of the finite elements under the load.
    const fem::Mesh &mesh = body.fem->mesh();
    body.fem->compute_forces();
    const Eigen::Matrix3Xd f = body.fem->gather(fem::NodalField::force),
                           inverse_mass = body.fem->gather(fem::NodalField::inverse_mass);
    std::vector<int> all(mesh.n_cells());
    for (int cell = 0; cell < mesh.n_cells(); ++cell)
      all[cell] = cell;
    const std::vector<fem::CellStiffness> stiffness = body.fem->cell_stiffness(all);
    std::vector<Eigen::Triplet<double>> entries;
    const auto dof = [&](int cell, int i) { return 2 * mesh.cells(i / 2, cell) + i % 2; };
    const auto is_free = [&](int i) { return inverse_mass(i % 2, i / 2) > 0.; };
    for (int cell = 0; cell < mesh.n_cells(); ++cell)
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < 8; ++j)
          if (is_free(dof(cell, i)) && is_free(dof(cell, j)))
            entries.emplace_back(dof(cell, i), dof(cell, j), stiffness[cell](i, j));
    Eigen::VectorXd right(2 * mesh.n_nodes());
    for (int i = 0; i < right.size(); ++i)
    {
      right[i] = is_free(i) ? f(i % 2, i / 2) : 0.;
      if (!is_free(i))
        entries.emplace_back(i, i, 1.);
    }
    Eigen::SparseMatrix<double> K(right.size(), right.size());
    K.setFromTriplets(entries.begin(), entries.end());
    const Eigen::VectorXd solution = Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(K).solve(right);
    Eigen::Matrix3Xd u = Eigen::Matrix3Xd::Zero(3, mesh.n_nodes());
    for (int a = 0; a < mesh.n_nodes(); ++a)
      u.col(a).head<2>() = solution.segment<2>(2 * a);
    body.fem->set_state(u, Eigen::Matrix3Xd::Zero(3, mesh.n_nodes()));
    body.model.start();
    const double whole = body.model.energies().elastic;
    ASSERT_NEAR(whole, 0.5 * solution.dot(right), 1e-3 * whole); // the solution is the static one, up to finite strains

    const std::vector<int> cells = cells_inside(mesh, {{Vector3d(4. * h, 6. * h, -1.), Vector3d(14. * h, 13. * h, 1.)}});
    double converted = 0.; // energy of the converted cells
    for (const int cell : cells)
    {
      Eigen::Matrix<double, 8, 1> local;
      for (int i = 0; i < 8; ++i)
        local[i] = solution[dof(cell, i)];
      converted += 0.5 * local.dot(stiffness[cell] * local);
    }
    body.model.activate(cells);
    kinetic[relaxation > 0] = largest_kinetic(body, 150) / converted;
  }
  std::cout << "[ load     ] kinetic " << 100. * kinetic[0] << " % by plain projection, " << 100. * kinetic[1]
            << " % moved to rest" << std::endl;
  EXPECT_LT(kinetic[1], 0.06);
  EXPECT_GT(kinetic[0], 2. * kinetic[1]);
}
