// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/hdf5_file.h"
#include "dem_side/packing/packing.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <hdf5.h>
#include <unistd.h>

using namespace kerf::dem;

namespace
{
class PackingStore : public testing::Test
{
protected:
  void SetUp() override
  {
    directory = std::filesystem::temp_directory_path() / ("kerf_packing_store_" + std::to_string(getpid()));
    std::filesystem::create_directories(directory);
    path = (directory / "rock.h5").string();

    PackingSettings settings;
    settings.kind = "triangular";
    settings.mean_diameter = 1. / 3.; // not exact in binary
    settings.lower = {-1.1, 0.7, 0.};
    settings.upper = {1.3, 3.1, 0.};
    packing = generate_packing(settings);
    packing.seed = 4294967295u;
    packing.calibration = {3.1e10,          1.7e9, 4.0e10, 0.23, 4.0000001e10, 0.2300001, 0.0123, {1.1e10, 1.3e10, 0.},
                           {0.21, 0.23, 0.}};
    packing.volume_filled = 5.7;
    packing.shape = {0.1, -1. / 3.};
    packing.quality = {0.91, 0.905, 5.1, 5.9, 1e-3, {0.49, 0.51, 0.}, 0.96};
  }
  void TearDown() override { std::filesystem::remove_all(directory); }

  /// What load_packing() says after "PATH: ".
  std::string load_error() const
  {
    try
    {
      load_packing(path);
    }
    catch (const std::invalid_argument &error)
    {
      const std::string text = error.what();
      EXPECT_EQ(text.substr(0, path.size() + 2), path + ": ");
      EXPECT_EQ(text.find('\n'), std::string::npos);
      return text.substr(path.size() + 2);
    }
    return "no error";
  }

  /// Saves the packing and then changes the file.
  template <class Change>
  std::string error_after(Change &&change)
  {
    save_packing(packing, path);
    const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
    change(file);
    H5Fclose(file);
    return load_error();
  }

  std::filesystem::path directory;
  std::string path;
  Packing packing;
};

void set_number(hid_t file, const char *name, double value)
{
  H5Adelete(file, name);
  const hid_t space = H5Screate(H5S_SCALAR);
  const hid_t attribute = H5Acreate2(file, name, H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, H5T_NATIVE_DOUBLE, &value);
  H5Aclose(attribute);
  H5Sclose(space);
}
} // namespace

TEST_F(PackingStore, RoundTripIsExact)
{
  save_packing(packing, path);
  const Packing loaded = load_packing(path);
  EXPECT_EQ(loaded.dim, packing.dim);
  EXPECT_EQ(loaded.kind, packing.kind);
  EXPECT_EQ(loaded.seed, packing.seed);
  EXPECT_EQ(loaded.gap_tolerance, packing.gap_tolerance);
  EXPECT_EQ(loaded.mean_diameter, packing.mean_diameter);
  EXPECT_EQ(loaded.lower, packing.lower);
  EXPECT_EQ(loaded.upper, packing.upper);
  EXPECT_EQ(loaded.positions, packing.positions);
  EXPECT_EQ(loaded.radii, packing.radii);
  EXPECT_EQ(loaded.bonds, packing.bonds);
  EXPECT_EQ(loaded.calibration.k_n, packing.calibration.k_n);
  EXPECT_EQ(loaded.calibration.k_t, packing.calibration.k_t);
  EXPECT_EQ(loaded.calibration.target_young, packing.calibration.target_young);
  EXPECT_EQ(loaded.calibration.target_poisson, packing.calibration.target_poisson);
  EXPECT_EQ(loaded.calibration.achieved_young, packing.calibration.achieved_young);
  EXPECT_EQ(loaded.calibration.achieved_poisson, packing.calibration.achieved_poisson);
  EXPECT_EQ(loaded.calibration.anisotropy, packing.calibration.anisotropy);
  EXPECT_EQ(loaded.calibration.axis_young, packing.calibration.axis_young);
  EXPECT_EQ(loaded.calibration.axis_poisson, packing.calibration.axis_poisson);
  EXPECT_EQ(loaded.volume_filled, packing.volume_filled);
  EXPECT_EQ(loaded.asked.mean_diameter, packing.asked.mean_diameter);
  EXPECT_EQ(loaded.asked.radius_spread, packing.asked.radius_spread);
  EXPECT_EQ(loaded.asked.gap_tolerance, packing.asked.gap_tolerance);
  EXPECT_EQ(loaded.shape, packing.shape);
  EXPECT_EQ(loaded.quality.solid_fraction, packing.quality.solid_fraction);
  EXPECT_EQ(loaded.quality.core_solid_fraction, packing.quality.core_solid_fraction);
  EXPECT_EQ(loaded.quality.coordination, packing.quality.coordination);
  EXPECT_EQ(loaded.quality.core_coordination, packing.quality.core_coordination);
  EXPECT_EQ(loaded.quality.largest_overlap, packing.quality.largest_overlap);
  EXPECT_EQ(loaded.quality.fabric, packing.quality.fabric);
  EXPECT_EQ(loaded.quality.isotropy, packing.quality.isotropy);
}

TEST_F(PackingStore, OverwritesOnlyWhenComplete)
{
  save_packing(packing, path);
  {
    kerf::Hdf5Writer half_done(path);
    half_done.attribute("format", std::string("something else"));
  } // dropped without close()
  EXPECT_EQ(load_packing(path).size(), packing.size());
  packing.calibration.k_n = 1.;
  save_packing(packing, path);
  EXPECT_EQ(load_packing(path).calibration.k_n, 1.);
  // No temporary file is left.
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(directory), std::filesystem::directory_iterator()), 1);
}

TEST_F(PackingStore, FilesThatAreNoPackings)
{
  EXPECT_EQ(load_error(), "does not exist");
  std::ofstream(path) << "positions: none\n";
  EXPECT_EQ(load_error(), "is not an HDF5 file, or cannot be read");
  {
    kerf::Hdf5Writer other(path);
    other.attribute("version", std::int64_t(1));
    other.close();
  }
  EXPECT_EQ(load_error(), "is not a packing file");
  save_packing(packing, path);
  std::filesystem::resize_file(path, std::filesystem::file_size(path) / 2);
  EXPECT_EQ(load_error(), "cannot be opened, the HDF5 file is damaged or in use");
}

TEST_F(PackingStore, DamagedPackingsAreNamed)
{
  EXPECT_EQ(error_after([](hid_t file) { set_number(file, "version", 7.); }),
            "has packing format version 7, this program reads version 2");
  EXPECT_EQ(error_after([](hid_t file) { set_number(file, "dim", 4.); }), "dim must be 2 or 3, not 4");
  EXPECT_EQ(error_after([](hid_t file) { set_number(file, "seed", 0.5); }), "attribute 'seed' is not a whole number");
  EXPECT_EQ(error_after([](hid_t file) { set_number(file, "kind", 1.); }), "attribute 'kind' is not a text");
  EXPECT_EQ(error_after([](hid_t file) { set_number(file, "upper", 1.); }), "attribute 'upper' must have 3 values");
  EXPECT_EQ(error_after([](hid_t file) { H5Adelete(file, "k_n"); }), "attribute 'k_n' is missing");
  EXPECT_EQ(error_after([](hid_t file) { H5Ldelete(file, "radii", H5P_DEFAULT); }), "data set 'radii' is missing");
  EXPECT_EQ(error_after(
              [](hid_t file)
              {
                H5Lmove(file, "positions", file, "p", H5P_DEFAULT, H5P_DEFAULT);
                H5Lmove(file, "bonds", file, "positions", H5P_DEFAULT, H5P_DEFAULT);
              }),
            "data set 'positions' must have 3 columns");
}

TEST_F(PackingStore, InconsistentPackingsAreNamed)
{
  const Packing good = packing;
  const int n = packing.size();
  const auto error_of = [&]
  {
    save_packing(packing, path);
    packing = good;
    return load_error();
  };
  packing.radii.conservativeResize(n - 2);
  EXPECT_EQ(error_of(), "has " + std::to_string(n) + " positions but " + std::to_string(n - 2) + " radii");
  packing.radii[3] = -1.;
  EXPECT_EQ(error_of(), "particle 3 has no radius in (0, mean diameter]");
  packing.positions(1, 5) = std::nan("");
  EXPECT_EQ(error_of(), "particle 5 is not in the box");
  packing.positions(2, 5) = 1e-3; // in two dimensions
  EXPECT_EQ(error_of(), "particle 5 is not in the box");
  packing.radii *= 10.;
  EXPECT_EQ(error_of(), "particle 0 has no radius in (0, mean diameter]");
  packing.radii *= 0.9;
  EXPECT_EQ(error_of(), "attribute 'mean_diameter' is not that of the radii");
  packing.positions.col(7) = packing.positions.col(6);
  EXPECT_EQ(error_of(), "particles 6 and 7 overlap");
  packing.volume_filled = 1.; // of 5.76
  EXPECT_EQ(error_of().substr(0, 54), "the particles do not fill their volume: solid fraction");
  packing.bonds.clear();
  EXPECT_EQ(error_of(), "the packing has no bonds");
  packing.bonds.back() = {0, n - 1};
  packing.bonds.erase(packing.bonds.begin() + 1, packing.bonds.end() - 1);
  std::sort(packing.bonds.begin(), packing.bonds.end());
  EXPECT_EQ(error_of(),
            "bond 1 joins particles 0 and " + std::to_string(n - 1) + ", which are further apart than the gap tolerance");
  packing.bonds[2] = {-1, 3};
  EXPECT_EQ(error_of(), "bond 2 joins particles -1 and 3 of " + std::to_string(n));
  packing.bonds[2] = {0, n};
  EXPECT_EQ(error_of(), "bond 2 joins particles 0 and " + std::to_string(n) + " of " + std::to_string(n));
  packing.bonds[2] = packing.bonds[1];
  EXPECT_EQ(error_of(), "bond 2 is double or out of order");
  packing.positions.resize(3, 0);
  packing.radii.resize(0);
  packing.bonds.clear();
  EXPECT_EQ(error_of(), "the packing holds no particles");
}

TEST_F(PackingStore, NumbersOutOfTheirRangeAreNamed)
{
  // Every number of the file, one after the other: what is not a number is in no range.
  std::vector<std::string> names;
  save_packing(packing, path);
  const hid_t file = H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT);
  const auto collect = [](hid_t, const char *name, const H5A_info_t *, void *list)
  {
    static_cast<std::vector<std::string> *>(list)->push_back(name);
    return herr_t(0);
  };
  H5Aiterate2(file, H5_INDEX_NAME, H5_ITER_INC, nullptr, collect, &names);
  H5Fclose(file);
  ASSERT_GT(names.size(), 25u);
  for (const std::string &name : names)
  {
    if (name == "units" || name == "format" || name == "kind" || name == "lattice_plane_at")
      continue;
    const std::string error = error_after(
      [&](hid_t store)
      {
        const hid_t attribute = H5Aopen(store, name.c_str(), H5P_DEFAULT), space = H5Aget_space(attribute);
        const auto n = H5Sget_simple_extent_npoints(space);
        H5Aclose(attribute);
        H5Sclose(space);
        H5Adelete(store, name.c_str());
        const std::vector<double> values(n, std::nan(""));
        const hsize_t size = n;
        const hid_t simple = n == 1 ? H5Screate(H5S_SCALAR) : H5Screate_simple(1, &size, nullptr);
        const hid_t written = H5Acreate2(store, name.c_str(), H5T_NATIVE_DOUBLE, simple, H5P_DEFAULT, H5P_DEFAULT);
        H5Awrite(written, H5T_NATIVE_DOUBLE, values.data());
        H5Aclose(written);
        H5Sclose(simple);
      });
    EXPECT_NE(error.find("'" + name + "'"), std::string::npos) << name << ": " << error;
  }
  EXPECT_EQ(error_after([](hid_t store) { set_number(store, "k_n", 0.); }).substr(0, 33), "attribute 'k_n' = 0 is not in [2.");
  EXPECT_EQ(error_after([](hid_t store) { set_number(store, "k_t", -1.); }).substr(0, 33), "attribute 'k_t' = -1 is not in [0");
  EXPECT_EQ(error_after([](hid_t store) { set_number(store, "dim", 3.); }),
            "attribute 'kind' = 'triangular' is no packing of 3 dimensions");
  EXPECT_EQ(error_after([](hid_t store) { set_number(store, "gap_tolerance", 3.); }),
            "attribute 'gap_tolerance' = 3 is not in [0, 2]");
}

TEST_F(PackingStore, PlacesThatCannotBeWrittenAreNamed)
{
  const std::string nowhere = (directory / "no" / "rock.h5").string();
  try
  {
    save_packing(packing, nowhere);
    FAIL() << "no error";
  }
  catch (const std::runtime_error &error)
  {
    EXPECT_EQ(error.what(), nowhere + ": cannot be written, No such file or directory");
  }
}

TEST_F(PackingStore, TablesInGroupsAndTextsOfEitherKind)
{
  const std::vector<double> row_by_row = {1., 2., 3., 4., 5., 6.};
  {
    kerf::Hdf5Writer file(path);
    file.table("history/force", row_by_row.data(), 3, 2);
    file.attribute("empty", std::string());
    file.attribute("text", std::string("E = 40 GPa, \xCE\xBD = 0.2"));
    file.close();
  }
  // A text of fixed length, as other programs write it.
  const hid_t handle = H5Fopen(path.c_str(), H5F_ACC_RDWR, H5P_DEFAULT);
  const hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
  H5Tset_size(type, 5);
  const hid_t attribute = H5Acreate2(handle, "fixed", type, space, H5P_DEFAULT, H5P_DEFAULT);
  H5Awrite(attribute, type, "chalk");
  H5Aclose(attribute);
  H5Sclose(space);
  H5Tclose(type);
  H5Fclose(handle);

  const kerf::Hdf5Reader file(path);
  EXPECT_EQ(file.table("history/force", 2), row_by_row);
  EXPECT_EQ(file.text("empty"), "");
  EXPECT_EQ(file.text("text"), "E = 40 GPa, \xCE\xBD = 0.2");
  EXPECT_EQ(file.text("fixed"), "chalk");
  EXPECT_TRUE(file.has_table("history/force"));
  EXPECT_FALSE(file.has_table("history/time"));
  EXPECT_FALSE(file.has_attribute("time"));
}
