// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/application/setup/packing_domain.h"
#include "coupler/base/errors.h"
#include "tests/support/test_surfaces.h"

#include <filesystem>
#include <gtest/gtest.h>
#include <map>
#include <unistd.h>

using namespace kerf;

namespace
{
/// Unit squares (2D) or cubes with the lower corners given, with the faces that belong to one cell only as boundary.
fem::Mesh mesh_of(int dim, const std::vector<std::array<int, 3>> &corners)
{
  fem::Mesh mesh;
  mesh.dim = dim;
  const int per_cell = 1 << dim;
  std::map<std::array<int, 3>, int> number;
  std::map<std::vector<int>, std::vector<fem::BoundaryFace>> faces;
  mesh.cells.resize(per_cell, corners.size());
  for (std::size_t cell = 0; cell < corners.size(); ++cell)
  {
    for (int k = 0; k < per_cell; ++k)
    {
      const std::array<int, 3> place = {
        {corners[cell][0] + (k & 1), corners[cell][1] + (k >> 1 & 1), corners[cell][2] + (k >> 2)}};
      mesh.cells(k, cell) = number.emplace(place, static_cast<int>(number.size())).first->second;
    }
    for (int axis = 0; axis < dim; ++axis)
      for (int side = 0; side < 2; ++side)
      {
        fem::BoundaryFace face;
        face.cell = static_cast<int>(cell);
        std::vector<int> key;
        for (int k = 0; k < per_cell; ++k)
          if ((k >> axis & 1) == side)
          {
            face.nodes[key.size()] = mesh.cells(k, cell);
            key.push_back(mesh.cells(k, cell));
          }
        std::sort(key.begin(), key.end());
        faces[key].push_back(face);
      }
  }
  for (const auto &[key, cells] : faces)
    if (cells.size() == 1)
      mesh.boundary.push_back(cells[0]);
  mesh.nodes.resize(3, number.size());
  for (const auto &[place, n] : number)
    mesh.nodes.col(n) << place[0], place[1], place[2];
  return mesh;
}

std::string error_of(const Case &settings, const fem::Mesh &mesh)
{
  try
  {
    find_packing_domain(settings, mesh);
  }
  catch (const InputError &error)
  {
    return error.what();
  }
  return "no error";
}

Case case_with(double diameter)
{
  Case settings;
  settings.directory = "rock";
  settings.packing.mean_diameter = diameter;
  return settings;
}
} // namespace

TEST(PackingDomain, IsTheBoxWhenTheMeshFillsIt)
{
  const PackingDomain flat = find_packing_domain(case_with(0.1), mesh_of(2, {{{0, 0, 0}}, {{1, 0, 0}}}));
  EXPECT_EQ(flat.surface, nullptr);
  EXPECT_DOUBLE_EQ(flat.volume, 2.);
  EXPECT_DOUBLE_EQ(flat.box.upper[0], 2.);
  const PackingDomain solid =
    find_packing_domain(case_with(0.1), mesh_of(3, {{{0, 0, 0}}, {{0, 1, 0}}, {{0, 0, 1}}, {{0, 1, 1}}}));
  EXPECT_EQ(solid.surface, nullptr);
  EXPECT_DOUBLE_EQ(solid.volume, 4.);
}

TEST(PackingDomain, IsTheBoundaryOfAnyOtherMesh)
{
  for (const int dim : {2, 3})
  {
    const fem::Mesh mesh = mesh_of(dim, {{{0, 0, 0}}, {{1, 0, 0}}, {{0, 1, 0}}});
    const PackingDomain space = find_packing_domain(case_with(0.1), mesh);
    ASSERT_NE(space.surface, nullptr);
    EXPECT_NEAR(space.volume, 3., 1e-12);
    const dem::ClosedSurface closed(dim, *space.surface, 0.1);
    EXPECT_TRUE(closed.contains({0.4, 1.6, 0.4}));
    EXPECT_FALSE(closed.contains({1.4, 1.6, 0.4}));
    EXPECT_NEAR(closed.area(), dim == 2 ? 8. : 14., 1e-12);
  }
}

TEST(PackingDomain, IsTheSurfaceFileInsideTheMesh)
{
  const fem::Mesh mesh = mesh_of(3, {{{0, 0, 0}}, {{1, 0, 0}}});
  Case settings = case_with(0.1);
  settings.packing_surface_file =
    std::filesystem::temp_directory_path() / ("kerf_packing_space_" + std::to_string(getpid()) + ".stl");
  dem::test::write_stl(dem::test::sphere(3, 0.5, {1., 0.5, 0.5}), settings.packing_surface_file, true);
  const PackingDomain space = find_packing_domain(settings, mesh);
  ASSERT_NE(space.surface, nullptr);
  EXPECT_NEAR(space.volume, std::acos(-1.) / 6., 0.01);
  EXPECT_NEAR(space.box.lower[0], 0.5, 1e-6);

  const std::string start = "rock/case.prm: Packing/Surface: ";
  dem::test::write_stl(dem::test::sphere(2, 0.5, {1.75, 0.5, 0.5}), settings.packing_surface_file, false);
  EXPECT_EQ(error_of(settings, mesh), start + settings.packing_surface_file +
                                        " reaches from 1.25 to 2.25 m along x, it must be inside of the mesh, 0 to 2");
  dem::SurfaceMesh open = dem::test::sphere(1, 0.4, {1., 0.5, 0.5});
  open.facets.pop_back();
  dem::test::write_stl(open, settings.packing_surface_file, true);
  EXPECT_EQ(error_of(settings, mesh).find(start + "closed surface: is not closed, 3 edges"), 0u) << error_of(settings, mesh);
  EXPECT_EQ(error_of(settings, mesh_of(2, {{{0, 0, 0}}})).find(start + "an STL surface needs"), 0u);
  std::filesystem::remove(settings.packing_surface_file);
  EXPECT_EQ(error_of(settings, mesh), start + settings.packing_surface_file + ": cannot be read");
}
