// SPDX-License-Identifier: GPL-2.0-or-later
#include "tests/support/fem_fixture.h"

#include <gtest/gtest.h>
#include <regex>
#include <sstream>

using namespace kerf::fem;
using namespace kerf::fem::test;

// Cells without weight are left out, on any division of the rest over the ranks.
TEST(FemOutput, OneFileHoldsTheActiveCellsOfAllRanks)
{
  const auto side = make_fem_side(box({0.8, 0.3, 0.}, 0.1));
  set_weights(*side, [](const Eigen::Vector3d &X) { return X[0] < 0.3 ? 1. : 0.; });
  const std::string path = (std::filesystem::temp_directory_path() / "kerf_fem_output_test.vtu").string();
  side->write_vtu(path, {{"distance", Eigen::VectorXd::LinSpaced(side->mesh().n_cells(), 0., 1.)}});
  MPI_Barrier(MPI_COMM_WORLD);

  std::stringstream text;
  text << std::ifstream(path).rdbuf();
  const std::string content = text.str();
  const std::regex piece("NumberOfCells=\"([0-9]+)\"");
  int n_cells = 0;
  for (std::sregex_iterator it(content.begin(), content.end(), piece), end; it != end; ++it)
    n_cells += std::stoi((*it)[1]);
  EXPECT_EQ(n_cells, 9);
  for (const char *name : {"displacement", "velocity", "alpha", "stress_xx", "stress_yy", "stress_zz", "stress_xy", "distance",
                           "smooth_stress_xx", "smooth_stress_xy"})
    EXPECT_NE(content.find("Name=\"" + std::string(name) + "\""), std::string::npos) << name;
  EXPECT_THROW(side->write_vtu(path, {{"short", Eigen::VectorXd::Zero(3)}}), std::logic_error);
  MPI_Barrier(MPI_COMM_WORLD);
  if (this_rank() == 0)
    std::filesystem::remove(path);
}

TEST(FemOutput, LibraryVersionNamesTheLibrary)
{
  EXPECT_TRUE(std::regex_match(library_version(), std::regex("deal\\.II [0-9]+\\.[0-9]+\\.[0-9]+.*")));
}
