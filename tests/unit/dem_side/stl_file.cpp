// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"
#include "tests/support/test_surfaces.h"

#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <stdexcept>
#include <string>
#include <unistd.h>

using namespace kerf::dem;

namespace
{
std::string stl_error_of(const std::string &bytes)
{
  const std::string path = std::filesystem::temp_directory_path() / ("kerf_surface_" + std::to_string(getpid()) + ".stl");
  std::ofstream(path, std::ios::binary) << bytes;
  std::string text = "no error";
  try
  {
    read_stl(path);
  }
  catch (const std::invalid_argument &error)
  {
    text = error.what();
    EXPECT_EQ(text.substr(0, path.size() + 2), path + ": ");
    text = text.substr(path.size() + 2);
  }
  std::filesystem::remove(path);
  return text;
}
} // namespace

TEST(StlFile, BothFormatsGiveTheSurface)
{
  const SurfaceMesh mesh = test::sphere(2, 0.5, {1., 1., 1.});
  const std::string path = std::filesystem::temp_directory_path() / ("kerf_stl_" + std::to_string(getpid()) + ".stl");
  for (const bool binary : {false, true})
  {
    test::write_stl(mesh, path, binary);
    const SurfaceMesh read = read_stl(path);
    ASSERT_EQ(read.facets.size(), mesh.facets.size());
    // Single precision in the binary format: corners merge all the same.
    EXPECT_NEAR(ClosedSurface(3, read, 0.1).volume(), ClosedSurface(3, mesh, 0.1).volume(), 1e-6);
  }
  std::filesystem::remove(path);
}

TEST(StlFile, DamagedOnesAreNamed)
{
  EXPECT_EQ(stl_error_of("some text"), "is not an STL file");
  EXPECT_EQ(stl_error_of(""), "is not an STL file");
  EXPECT_EQ(stl_error_of("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n"), "vertex 1 does not have three numbers");
  EXPECT_EQ(stl_error_of("solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\nendfacet\n"),
            "facet 1 does not have three vertices");
  try
  {
    read_stl("/nowhere/a.stl");
    FAIL() << "no error";
  }
  catch (const std::invalid_argument &error)
  {
    EXPECT_STREQ(error.what(), "/nowhere/a.stl: cannot be read");
  }
}
