// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"

#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
constexpr std::size_t header_size = 80, facet_size = 50; // bytes of the binary format

SurfaceMesh from_corners(const std::vector<double> &values)
{
  SurfaceMesh mesh;
  mesh.points = Eigen::Map<const Eigen::Matrix3Xd>(values.data(), 3, values.size() / 3);
  for (int i = 0; i + 2 < static_cast<int>(mesh.points.cols()); i += 3)
    mesh.facets.push_back({i, i + 1, i + 2});
  return mesh;
}
} // namespace

SurfaceMesh read_stl(const std::string &path)
{
  const auto fail = [&path](const std::string &what) { throw std::invalid_argument(path + ": " + what); };
  std::ifstream file(path, std::ios::binary);
  if (!file)
    fail("cannot be read");
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());

  // A binary file may begin with "solid", too. It is recognised by its length, which follows from its number of facets.
  std::uint32_t count = 0;
  if (bytes.size() >= header_size + 4)
    std::memcpy(&count, bytes.data() + header_size, 4);
  std::vector<double> values;
  if (bytes.size() >= header_size + 4 && bytes.size() == header_size + 4 + facet_size * std::size_t(count))
  {
    for (std::size_t f = 0; f < count; ++f)
    {
      float numbers[9]; // the three corners, which follow the normal
      std::memcpy(numbers, bytes.data() + header_size + 4 + facet_size * f + 12, sizeof numbers);
      values.insert(values.end(), numbers, numbers + 9);
    }
    return from_corners(values);
  }
  std::istringstream words(bytes);
  std::string word;
  if (!(words >> word) || word != "solid")
    fail("is not an STL file");
  while (words >> word)
  {
    if (word == "vertex")
    {
      double x[3];
      if (!(words >> x[0] >> x[1] >> x[2]))
        fail("vertex " + std::to_string(values.size() / 3 + 1) + " does not have three numbers");
      values.insert(values.end(), x, x + 3);
    }
    else if (word == "endfacet" && (values.empty() || values.size() % 9 != 0))
      fail("facet " + std::to_string(values.size() / 9 + 1) + " does not have three vertices");
  }
  if (values.size() % 9 != 0)
    fail("ends within a facet");
  return from_corners(values);
}
} // namespace kerf::dem
