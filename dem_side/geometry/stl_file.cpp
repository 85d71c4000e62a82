// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/geometry/closed_surface.h"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
const std::string byte_order_mark = "\xEF\xBB\xBF";      // of a text in UTF-8
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
  std::error_code ignored;
  if (std::filesystem::exists(path, ignored) && !std::filesystem::is_regular_file(path, ignored)) // reading a fifo would wait
    fail("is not a file");
  std::ifstream file(path, std::ios::binary);
  if (!file)
    fail("cannot be read");
  const std::string bytes((std::istreambuf_iterator<char>(file)), std::istreambuf_iterator<char>());

  // A binary file may begin with "solid", too. Its number of facets tells, which of a text is far larger than the file.
  std::uint32_t count = 0;
  if (bytes.size() >= header_size + 4)
    std::memcpy(&count, bytes.data() + header_size, 4);
  std::vector<double> values;
  if (count > 0 && bytes.size() >= header_size + 4 + facet_size * std::size_t(count)) // trailing bytes do not matter
  {
    for (std::size_t f = 0; f < count; ++f)
    {
      float numbers[9]; // the three corners, which follow the normal
      std::memcpy(numbers, bytes.data() + header_size + 4 + facet_size * f + 12, sizeof numbers);
      values.insert(values.end(), numbers, numbers + 9);
    }
    return from_corners(values);
  }
  std::istringstream words(bytes.rfind(byte_order_mark, 0) == 0 ? bytes.substr(byte_order_mark.size()) : bytes);
  const auto next = [&words](std::string &word)
  {
    const bool found = static_cast<bool>(words >> word);
    std::transform(word.begin(), word.end(), word.begin(), [](unsigned char c) { return std::tolower(c); });
    return found;
  };
  std::string word;
  const bool is_text = next(word) && word == "solid" && bytes.find('\0') == std::string::npos;
  if (!is_text && bytes.size() >= header_size + 4 + facet_size)
    fail("is cut off: it announces " + std::to_string(count) + " facets and holds " +
         std::to_string((bytes.size() - header_size - 4) / facet_size) + ", export it again");
  if (!is_text)
    fail("is not an STL file");
  do
  {
    if (word == "solid" || word == "endsolid")
      words.ignore(std::numeric_limits<std::streamsize>::max(), '\n'); // a name of any words
    else if (word == "vertex")
    {
      double x[3];
      if (!(words >> x[0] >> x[1] >> x[2]))
        fail("vertex " + std::to_string(values.size() / 3 + 1) + " does not have three numbers");
      values.insert(values.end(), x, x + 3);
    }
    else if (word == "endfacet" && (values.empty() || values.size() % 9 != 0))
      fail("facet " + std::to_string(values.size() / 9 + 1) + " does not have three vertices");
  } while (next(word));
  if (values.size() % 9 != 0)
    fail("ends within a facet");
  return from_corners(values);
}
} // namespace kerf::dem
