// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/case_file/strengths.h"
#include "coupler/application/case_file/case_file.h"
#include "coupler/base/errors.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <sstream>
#include <unistd.h>

using namespace kerf;

namespace
{
/// A case directory that is removed at the end.
class CaseDirectory
{
public:
  CaseDirectory() : path((std::filesystem::temp_directory_path() / ("kerf_strengths_" + std::to_string(getpid()))).string())
  {
    std::filesystem::create_directories(path);
    std::ofstream(path + "/case.prm") << "subsection Rock\n set Young modulus = 20e9\n set Tensile strength = 11e6\n"
                                         " set Compressive strength = 50e6\nend\nsubsection Tool\n set Kind = none\nend\n";
  }
  ~CaseDirectory() { std::filesystem::remove_all(path); }
  Case read(const std::vector<Override> &overrides) const { return read_case(path, overrides); }
  std::string error(const std::vector<Override> &overrides) const
  {
    try
    {
      read(overrides);
    }
    catch (const InputError &error)
    {
      return error.what();
    }
    return "";
  }

  const std::string path;
};

Strengths measured(const Case &settings)
{
  Strengths strengths = strengths_wanted(settings);
  strengths.bond.R_n = 22e3;
  strengths.bond.R_t = 44e3;
  strengths.n_packings = 3;
  strengths.tensile = {10.8e6, 0.2e6};
  strengths.compressive = {51e6, 2e6};
  strengths.brazilian = {9e6, 0.3e6};
  strengths.specimen_young = {19.9e9, 0.2e9};
  strengths.specimen_poisson = {0.21, 0.01};
  return strengths;
}
const Override calibrated = "Bond/Strength=calibrated";
} // namespace

// The file gives bonds, criteria and sigma* the measured values, for any seed; R_n and R_t grow with d in the plane.
TEST(Strengths, CaseUsesWhatWasMeasured)
{
  const CaseDirectory directory;
  EXPECT_NE(directory.error({calibrated}).find("strengths.txt does not exist; run kerf calibrate"), std::string::npos);
  save_strengths(measured(directory.read({})), directory.path);

  for (const double d : {1e-3, 0.25e-3})
  {
    const Case used = directory.read({calibrated, "Packing/Seed=7", "Packing/Mean diameter=" + std::to_string(d)});
    // The file has six digits.
    EXPECT_NEAR(used.bond.R_n, 22e3 * d / 1e-3, 0.1);
    EXPECT_NEAR(used.bond.R_t, 44e3 * d / 1e-3, 0.1);
    EXPECT_NEAR(used.activation.tensile_strength, 10.8e6, 10.);
    EXPECT_NEAR(used.activation.compressive_strength, 51e6, 100.);
    EXPECT_NEAR(used.activation.sigma_star, 0.5 * 10.8e6, 10.);
  }
  EXPECT_NEAR(directory.read({calibrated, "Adaptivity/Sigma star fraction=0.7"}).activation.sigma_star, 0.7 * 10.8e6, 10.);
  EXPECT_EQ(directory.read({calibrated, "Adaptivity/Sigma star=3e6"}).activation.sigma_star, 3e6);
  EXPECT_NE(directory.read({calibrated}).strength_summary.find("5.4 MPa = 0.5 x direct tensile strength"), std::string::npos);

  // The echo holds numbers, and means the same without the file.
  const Case used = directory.read({calibrated});
  std::ofstream(directory.path + "/case.prm") << used.used_parameters;
  std::filesystem::remove(strengths_file(directory.path));
  const Case again = directory.read({});
  EXPECT_DOUBLE_EQ(again.bond.R_t, used.bond.R_t);
  EXPECT_DOUBLE_EQ(again.activation.compressive_strength, used.activation.compressive_strength);
  EXPECT_DOUBLE_EQ(again.activation.sigma_star, used.activation.sigma_star);
}

// Bonds as given: sigma* is a fraction of the rock's strength, and the summary says that nothing was measured.
TEST(Strengths, GivenBonds)
{
  const CaseDirectory directory;
  const Case used = directory.read({});
  EXPECT_DOUBLE_EQ(used.activation.sigma_star, 0.5 * 11e6);
  EXPECT_NE(used.strength_summary.find("notice"), std::string::npos);
}

// Strengths of another kind of packing, rock or bond are refused in one line that names the key.
TEST(Strengths, OtherRocksAreRefused)
{
  const CaseDirectory directory;
  save_strengths(measured(directory.read({})), directory.path);
  for (const std::string key :
       {"Rock/Young modulus=21e9", "Rock/Poisson ratio=0.25", "Rock/Tensile strength=12e6", "Rock/Compressive strength=40e6",
        "Packing/Radius spread=0.2", "Packing/Gap tolerance=0.2", "Bond/Friction=0.4", "Bond/Shear strength friction=1"})
  {
    const std::string error = directory.error({calibrated, key});
    EXPECT_NE(error.find("strengths.txt holds for " + key.substr(0, key.find('='))), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos);
  }
  EXPECT_NE(directory.error({calibrated, "Packing/Kind=triangular"}).find("the case has triangular 2d"), std::string::npos);

  // A file without all values, as of another version.
  std::ofstream(strengths_file(directory.path)) << "kind = random 2d\nR_n = 1\n";
  EXPECT_NE(directory.error({calibrated}).find("has no value of"), std::string::npos);
}
