// SPDX-License-Identifier: GPL-2.0-or-later
// Spheres with all kinds of boundaries: the exported script moves it as the particle side does.
#include "coupler/application/stand_alone/export_case.h"
#include "coupler/application/stand_alone/script_forces.h"
#include "tests/support/dem_test_packings.h"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <sstream>

using namespace kerf;
namespace test = kerf::dem::test;

namespace
{
struct Motion
{
  Eigen::Matrix3Xd position, velocity, spin; ///< by index in the packing
};

/// Last snapshot of particles.dump: id type radius x y z vx vy vz omegax omegay omegaz broken.
Motion read_dump(const std::string &path, int n)
{
  std::ifstream file(path);
  Motion motion{Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n), Eigen::Matrix3Xd(3, n)};
  int found = 0;
  for (std::string line; std::getline(file, line);)
    if (line.rfind("ITEM: ATOMS", 0) == 0)
      for (found = 0; found < n && std::getline(file, line); ++found)
      {
        std::istringstream row(line);
        int id = 0, type = 0;
        double radius = 0.;
        row >> id >> type >> radius;
        for (Eigen::Matrix3Xd *field : {&motion.position, &motion.velocity, &motion.spin})
          for (int c = 0; c < 3; ++c)
            row >> (*field)(c, id - 1);
      }
  EXPECT_EQ(found, n);
  return motion;
}

void replace_all(std::string &text, const std::string &from, const std::string &to)
{
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
    text.replace(at, from.size(), to);
}

Motion run_script(const std::string &directory, int n)
{
  std::ifstream file(directory + "/" + script_name);
  std::string text{std::istreambuf_iterator<char>(file), {}};
  replace_all(text, "%.10g", "%.17g");
  std::ofstream(directory + "/precise") << text;
  const auto before = std::filesystem::current_path();
  std::filesystem::current_path(directory); // paths in the script start there
  std::string words[] = {"liggghts", "-in", "precise", "-screen", "none", "-log", "none"};
  char *argv[7];
  for (int k = 0; k < 7; ++k)
    argv[k] = words[k].data();
  dem::run_script(7, argv, MPI_COMM_SELF, script_forces());
  std::filesystem::current_path(before);
  return read_dump(directory + "/particles.dump", n);
}
/// A body that is driven, damped and broken by the particle side and by the script that is written for it.
void expect_same_motion(const dem::Packing &packing, const std::vector<fem::BoundaryCondition> &conditions)
{
  fem::Settings rock;
  rock.comm = MPI_COMM_SELF;
  rock.dim = 3;
  rock.mesh.lower = packing.lower;
  rock.mesh.upper = packing.upper;
  for (int c = 0; c < 3; ++c)
    rock.mesh.periodic[c] = packing.periodic[c] > 0.;
  rock.mesh.cell_size = 0.25 * (packing.upper - packing.lower).maxCoeff();
  rock.material = {2400., 20e9, 0.2};
  const std::unique_ptr<fem::FemSide> fem = fem::make_fem_side(rock);

  Case settings;
  settings.name = "block";
  settings.body.material = rock.material;
  settings.packing.dim = settings.body.dim = 3;
  settings.body.boundary_conditions = conditions;
  dem::Settings particles = test::settings(packing);
  particles.comm = MPI_COMM_SELF;
  particles.time_step = 6e-9;                                             // a quarter of the stable step
  particles.bond.R_n = 2e-3 * packing.mean_diameter * particles.bond.k_n; // some bonds break on the way
  particles.bond.R_t = 1e-3 * packing.mean_diameter * particles.bond.k_n;
  particles.bond.damping = 0.05;
  particles.local_damping = settings.local_damping = 0.1;
  settings.bond = particles.bond;
  settings.history_interval = 1000;
  settings.n_snapshots = 1;

  const std::string directory = testing::TempDir() + "kerf_export_3d";
  std::filesystem::create_directories(directory);
  settings.packing_file = directory + "/store.h5";
  dem::save_packing(packing, settings.packing_file);

  ParticleBoundary boundary(fem->mesh(), settings.body.material, settings.body.boundary_conditions, packing,
                            0.25 * packing.mean_diameter);
  constexpr int steps = 1000;
  ParticleWork driven(particles.time_step, MPI_COMM_SELF), absorbed(particles.time_step, MPI_COMM_SELF);
  int n = 0;
  const dem::ForceHook hook = [&](dem::Phase phase, dem::Particles &all)
  {
    n += phase == dem::Phase::step;
    driven.begin(phase, all);
    absorbed.begin(phase, all);
    boundary.damp(all, absorbed);
    boundary.hold(all, n * particles.time_step, particles.time_step, driven);
  };
  dem::DemSide side(particles);
  test::start(side, packing, test::all_particles(packing), hook);
  side.advance(steps, hook);
  EXPECT_GT(side.n_bonds_broken(), 10);
  if (conditions.front().kind == fem::BoundaryKind::absorbing)
  {
    EXPECT_GT(absorbed.local(), -driven.local());
    EXPECT_LT(absorbed.local(), 0.);
  }

  write_script({settings, packing, boundary, particles, steps, ""}, directory);
  const Motion script = run_script(directory, packing.size());
  const Eigen::Matrix3Xd position = test::gather(side, packing, test::Quantity::position, MPI_COMM_SELF);
  const Eigen::Matrix3Xd velocity = test::gather(side, packing, test::Quantity::velocity, MPI_COMM_SELF);
  const Eigen::Matrix3Xd spin = test::gather(side, packing, test::Quantity::angular_velocity, MPI_COMM_SELF);
  double moved = 0., apart = 0.;
  for (int i = 0; i < packing.size(); ++i)
  {
    moved = std::max(moved, packing.displacement(i, position.col(i)).norm());
    apart = std::max(apart, packing.shortest(script.position.col(i) - position.col(i)).norm());
  }
  EXPECT_GT(moved, 5e-6);
  // Round-off of 1000 steps (times of the ramp, order of sums), magnified by the bonds that break: far below any difference in
  // the forces, which would show in parts of the displacement.
  EXPECT_LT(apart, 1e-8 * moved);
  EXPECT_LT((script.velocity - velocity).colwise().norm().maxCoeff(), 1e-7 * velocity.colwise().norm().maxCoeff());
  EXPECT_LT((script.spin - spin).colwise().norm().maxCoeff(), 1e-7 * spin.colwise().norm().maxCoeff());
  std::filesystem::remove_all(directory);
}

fem::BoundaryCondition condition(int id, fem::BoundaryKind kind)
{
  return {id, "", kind};
}

fem::BoundaryCondition push(int id, const Eigen::Vector3d &velocity)
{
  fem::BoundaryCondition result = condition(id, fem::BoundaryKind::velocity);
  result.velocity = velocity;
  result.ramp = 2e-6;
  return result;
}
} // namespace

TEST(ExportedScript, MovesABlockOfSpheresAsTheParticleSide)
{
  expect_same_motion(test::fcc_lattice(4, 5e-4),
                     {condition(0, fem::BoundaryKind::absorbing), condition(2, fem::BoundaryKind::fixed),
                      push(3, {1., 4., -2.}), condition(4, fem::BoundaryKind::roller)});
}

TEST(ExportedScript, KeepsPeriodicAxes)
{
  dem::PackingSettings bar;
  bar.kind = "fcc";
  bar.dim = 3;
  bar.mean_diameter = 1e-3;
  bar.upper = std::sqrt(2.) * bar.mean_diameter * Eigen::Vector3d(6., 4., 4.);
  bar.periodic = {{false, true, true}};
  expect_same_motion(dem::generate_packing(bar), {condition(0, fem::BoundaryKind::fixed), push(1, {6., 6., -3.})});
}
