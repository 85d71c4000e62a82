// SPDX-License-Identifier: GPL-2.0-or-later
// Force of a disc when cells below it become particles, before it touches them and under load.
#include "coupler/application/setup/problem.h"

#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>

using namespace kerf;

namespace
{
const std::string rock = R"(
subsection Rock
  set Density              = 2400
  set Young modulus        = 18.7e9
  set Poisson ratio        = 0.2
  set Tensile strength     = 10e6
  set Compressive strength = 30e6
end
subsection Boundary
  set Conditions = left: roller; right: roller; bottom: fixed
end
subsection Packing
  set Mean diameter = 1e-3
  set Radius spread = 0.3
end
subsection Bond
  set Tensile strength = 1e12
  set Shear strength   = 1e12
end
subsection Adaptivity
  set Check interval = 20
end
subsection Tool
  set Smoothing time = 2e-5
  set Rolling        = false
end
)";

const std::string plane = rock + R"(
subsection Mesh
  set Lower corner = 0, 0
  set Upper corner = 0.032, 0.016
  set Cell size    = 4e-3
end
subsection Coupling
  set Overlap width = 6
end
subsection Tool
  set Radius = 0.025
  set Path   = 0 0.016 0.04101;  1.1e-4 0.016 0.0409;  1e-3 0.016 0.0409
end
)";

const std::string space = rock + R"(
subsection Mesh
  set Dimension    = 3
  set Lower corner = 0, 0, 0
  set Upper corner = 0.016, 0.012, 0.012
  set Cell size    = 2e-3
end
subsection Coupling
  set Method        = penalty_mass_scaled
  set Overlap width = 3
end
subsection Tool
  set Radius = 0.02
  set Width  = 0.006
  set Middle = 0.006
  set Path   = 0 0.008 0.03201;  1.1e-4 0.008 0.0319;  1e-3 0.008 0.0319
end
)";

/// A case in a directory of its own, with its store, and its model at the start.
struct Indentation
{
  Indentation(const std::string &name, const std::string &text, const std::vector<std::string> &overrides,
              Mode mode = Mode::adaptive)
  {
    const std::string directory = testing::TempDir() + "/kerf_tool_contact_" + name;
    static std::set<std::string> fresh; // a store from an earlier run of the tests may be another one
    if (fresh.insert(directory).second)
      std::filesystem::remove_all(directory);
    std::filesystem::create_directories(directory);
    std::ofstream(directory + "/case.prm") << text;
    Console silent(false);
    problem = set_up_problem(read_case(directory, overrides), mode, silent, MPI_COMM_WORLD);
    model = std::make_unique<CoupledModel>(problem->settings, mode, *problem->fem, problem->packing, problem->dt,
                                           MPI_COMM_WORLD, std::move(problem->constraint));
    model->start();
  }
  double force() const { return -model->tool().local_load().force[1]; } ///< of the last state [N]

  /// Mean force over @p duration [s].
  double mean_force(double duration)
  {
    model->take_tool_force();
    model->advance(static_cast<int>(duration / problem->dt));
    return model->take_tool_force().mean[1];
  }

  std::unique_ptr<Problem> problem;
  std::unique_ptr<CoupledModel> model;
};

/// Largest changes by conversions in a run to @p end [s], counted once the force exceeds @p small_force [N].
struct Changes
{
  int events = 0;
  double force = 0.;  ///< change of the force at constant time over the force
  double energy = 0.; ///< loss over the elastic energy
};
Changes largest_changes(Indentation &run, double end, double small_force)
{
  Changes changes;
  while (run.model->time() < end)
  {
    run.model->advance(run.problem->settings.activation.check_interval);
    const double before = run.force();
    if (!run.model->adapt() || before < small_force)
      continue;
    const ActivationEvent &event = run.model->events().back();
    ++changes.events;
    changes.force = std::max(changes.force, std::abs(run.force() / before - 1.));
    changes.energy = std::max(changes.energy, (event.held_before - event.held_after) / event.before.elastic);
    std::printf("t %.4g s, %d cells: force %.4g -> %.4g N, elastic %.4g -> %.4g J\n", event.time, event.cells, before,
                run.force(), event.before.elastic, event.after.elastic);
  }
  return changes;
}
} // namespace

// Cells below the disc become particles before it touches them, and later ones below by sigma* under its load. Neither may
// change the force by more than 3 % or lose more than 2 % of the stored energy.
TEST(ToolContact, ForceDoesNotJumpInThePlane)
{
  Indentation run("plane", plane, {"Adaptivity/Sigma star=4e6"});
  ASSERT_EQ(run.model->events().size(), 1u);              // before the first step
  EXPECT_LT(run.model->events()[0].after.elastic, 1e-20); // round-off
  const Changes changes = largest_changes(run, 1.2e-4, 10e3);
  EXPECT_GT(changes.events, 1);
  EXPECT_LT(changes.force, 0.03);
  EXPECT_LT(changes.energy, 0.02);
}

TEST(ToolContact, ForceDoesNotJumpInSpace)
{
  Indentation run("space", space, {"Adaptivity/Sigma star=4e6"});
  ASSERT_EQ(run.model->events().size(), 1u);
  const Changes changes = largest_changes(run, 1.2e-4, 50.);
  EXPECT_GT(changes.events, 1);
  EXPECT_LT(changes.force, 0.03);
  EXPECT_LT(changes.energy, 0.02);
}

// Without it the cells that are converted first carry the contact, and the force breaks down.
TEST(ToolContact, ConversionUnderTheContactWouldJump)
{
  Indentation run("plane", plane, {"Adaptivity/Sigma star=4e6", "Adaptivity/Contact activation=false"});
  EXPECT_TRUE(run.model->events().empty());
  const Changes changes = largest_changes(run, 1.2e-4, 10e3);
  EXPECT_GT(changes.force, 0.03);
}

// A disc at rest at its depth: cells below the particle region are converted under load. The force over many periods is that of
// before, since both models have the same stiffness.
TEST(ToolContact, ForceOfAHeldDiscStaysWhenMoreCellsAreConverted)
{
  Indentation run("plane", plane, {"Adaptivity/Sigma star=1e15", "Bond/Local damping=0.3"});
  run.model->advance(static_cast<int>(2e-4 / run.problem->dt));
  const double before = run.mean_force(1e-4);
  std::vector<int> below;
  for (int cell = 0; cell < run.problem->fem->mesh().n_cells(); ++cell)
    if (!run.model->overlap().is_converted(cell) &&
        (cell_centre(run.problem->fem->mesh(), cell) - Eigen::Vector3d(0.016, 0.016, 0.)).norm() < 0.01)
      below.push_back(cell);
  run.model->activate(below);
  const double after = run.mean_force(1e-4);
  std::printf("%zu cells: force %.4g -> %.4g N\n", below.size(), before, after);
  EXPECT_NEAR(after / before, 1., 0.03);
}

// With cells converted before contact and by sigma* the force is that of full DEM on the same packing.
TEST(ToolContact, ForceIsThatOfFullDem)
{
  std::array<double, 2> force;
  for (const Mode mode : {Mode::adaptive, Mode::dem})
  {
    Indentation run("plane", plane, {"Adaptivity/Sigma star=4e6", "Bond/Local damping=0.3"}, mode);
    const auto interval = run.problem->settings.activation.check_interval;
    while (run.model->time() < 2e-4)
    {
      run.model->advance(interval);
      run.model->adapt();
    }
    force[mode == Mode::dem] = run.mean_force(1e-4);
  }
  std::printf("force adaptive %.4g, full DEM %.4g N\n", force[0], force[1]);
  EXPECT_NEAR(force[0] / force[1], 1., 0.02);
}

// Coarse cells cannot resolve a round tool, but faces on faces need no resolution: platens convert none.
TEST(ToolContact, PlatensConvertNoCells)
{
  Indentation run("platens", plane, {"Tool/Kind=platens", "Boundary/Conditions=", "Adaptivity/Sigma star=1e15"});
  run.model->advance(100);
  EXPECT_FALSE(run.model->adapt());
  EXPECT_TRUE(run.model->events().empty());
}

// A spring ten times as stiff as the default one, whose step is smaller, changes the force by at most 2 %.
void expect_stiff_contact(Mode mode)
{
  std::array<double, 2> force;
  for (int stiff = 0; stiff < 2; ++stiff)
  {
    std::vector<std::string> overrides = {"Adaptivity/Sigma star=1e15", "Bond/Local damping=0.3"};
    if (stiff)
      overrides.emplace_back(mode == Mode::fem ? "Tool/Stiffness ratio=250" : "Tool/Stiffness ratio=100");
    Indentation run("plane", plane, overrides, mode);
    run.model->advance(static_cast<int>(2e-4 / run.problem->dt));
    force[stiff] = run.mean_force(1e-4);
  }
  std::printf("force %.4g, with the stiffer contact %.4g N\n", force[0], force[1]);
  EXPECT_NEAR(force[0] / force[1], 1., 0.02) << name_of(mode);
}

TEST(ToolContact, DefaultContactIsStiff)
{
  expect_stiff_contact(Mode::adaptive);
  expect_stiff_contact(Mode::dem);
  expect_stiff_contact(Mode::fem);
}

// The largest step leaves room for the contact, whose stiffness follows it, on particles and on cells finer than particles. An
// unstable contact would multiply its energy within a few steps.
TEST(ToolContact, IsStableAtTheLargestStep)
{
  for (const Mode mode : {Mode::adaptive, Mode::dem, Mode::fem})
  {
    std::vector<std::string> overrides = {"Adaptivity/Sigma star=1e15", "Time/Safety=0.99"};
    if (mode == Mode::fem)
      overrides.emplace_back("Mesh/Cell size=1e-3");
    Indentation run("plane", plane, overrides, mode);
    EXPECT_GE(run.problem->dt, 0.98 * run.problem->stable.coupled);
    run.model->advance(2000);
    const EnergyLedger energy = run.model->energies();
    EXPECT_GT(energy.tool_work, 1.);
    EXPECT_LT(energy.kinetic, 0.05 * energy.elastic);
    EXPECT_LT(std::abs(energy.residual()), 1e-3 * energy.tool_work);
  }
}

// Cells that wait unloaded for the disc do not return to finite elements.
TEST(ToolContact, CellsBelowTheToolDoNotReturn)
{
  Indentation run("plane", plane,
                  {"Adaptivity/Sigma star=1e15", "Adaptivity/Return fraction=0.9", "Adaptivity/Return time=1e-6",
                   "Tool/Path=0 0.016 0.0415"});
  for (int k = 0; k < 5; ++k)
  {
    run.model->advance(20);
    EXPECT_FALSE(run.model->adapt());
  }
  EXPECT_GT(run.model->overlap().n_converted(), 0);
}
