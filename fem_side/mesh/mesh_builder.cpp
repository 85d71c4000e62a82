// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/mesh_builder.h"

#include "fem_side/element/q1_cell.h"
#include "fem_side/mesh/graded_axis.h"

#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/grid_in.h>
#include <deal.II/grid/grid_tools.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <numeric>
#include <set>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
template <int dim>
void check_box(const MeshSettings &s)
{
  for (int d = 0; d < dim; ++d)
    if (!(s.upper[d] > s.lower[d]))
      throw std::invalid_argument("mesh: the upper box corner must lie above the lower one in every direction");
  if (!(s.cell_size > 0.))
    throw std::invalid_argument("mesh: the cell size must be positive");
  if (!(s.growth >= 1.))
    throw std::invalid_argument("mesh: the growth of the cell size must be at least 1");
  if (s.largest_cell_size != 0. && !(s.largest_cell_size >= s.cell_size))
    throw std::invalid_argument("mesh: the largest cell size must not be below the cell size");
}

template <int dim>
void structured_box(const MeshSettings &s, dealii::Triangulation<dim> &triangulation)
{
  check_box<dim>(s);
  std::array<std::vector<double>, dim> x;
  std::vector<unsigned int> repetitions(dim);
  dealii::Point<dim> upper;
  for (int d = 0; d < dim; ++d)
  {
    x[d] = vertex_coordinates(
      {s.lower[d], s.upper[d], s.cell_size, s.fine_lower[d], s.fine_upper[d], s.growth, s.largest_cell_size});
    repetitions[d] = x[d].size() - 1;
    upper[d] = repetitions[d];
  }
  // Built on integers and then moved, so that every vertex gets exactly its coordinate.
  dealii::GridGenerator::subdivided_hyper_rectangle(triangulation, repetitions, dealii::Point<dim>(), upper, true);
  dealii::GridTools::transform(
    [&x](const dealii::Point<dim> &index)
    {
      dealii::Point<dim> vertex;
      for (int d = 0; d < dim; ++d)
        vertex[d] = x[d][std::lround(index[d])];
      return vertex;
    },
    triangulation);
}

/// Blocks around a square in the middle. They are refined as a whole, so cells may be down to half of the size asked for.
template <int dim>
void disc(const MeshSettings &s, dealii::Triangulation<dim> &triangulation)
{
  check_box<dim>(s);
  const Eigen::Vector3d extent = s.upper - s.lower, centre = 0.5 * (s.lower + s.upper);
  if (std::abs(extent[0] - extent[1]) > 1e-9 * extent[0])
    throw std::invalid_argument("mesh: a disc needs a box of equal width and height");
  if (s.fine_lower != s.fine_upper)
    throw std::invalid_argument("mesh: a disc has no fine zone");
  dealii::Triangulation<2> ball, flat;
  dealii::GridGenerator::hyper_ball_balanced(ball, {centre[0], centre[1]}, 0.5 * extent[0]);
  while (dealii::GridTools::maximal_cell_diameter(ball) > std::sqrt(2.) * s.cell_size)
    ball.refine_global();
  dealii::GridGenerator::flatten_triangulation(ball, flat);
  const double flat_height = 0.5 * extent[0] * std::cos(s.flat_angle);
  if (0.5 * extent[0] - flat_height > 0.5 * s.cell_size)
    throw std::invalid_argument(
      "mesh: the flats of the disc are deeper than half a cell, take larger cells or a smaller angle");
  dealii::GridTools::transform(
    [&](const dealii::Point<2> &x)
    { return dealii::Point<2>(x[0], std::clamp(x[1], centre[1] - flat_height, centre[1] + flat_height)); },
    flat);
  if constexpr (dim == 2)
    triangulation.copy_triangulation(flat);
  else
  {
    const unsigned int layers = std::max(1L, std::lround(extent[2] / s.cell_size));
    dealii::GridGenerator::extrude_triangulation(flat, layers + 1, extent[2], triangulation);
    dealii::GridTools::shift(dealii::Point<3>(0., 0., s.lower[2]), triangulation);
  }
  for (const auto &cell : triangulation.active_cell_iterators())
    for (const auto &face : cell->face_iterators())
      if (face->at_boundary())
      {
        bool back = dim == 3, front = dim == 3;
        for (const auto v : face->vertex_indices())
        {
          back = back && face->vertex(v)[dim - 1] < s.lower[2] + 1e-9 * extent[2];
          front = front && face->vertex(v)[dim - 1] > s.upper[2] - 1e-9 * extent[2];
        }
        face->set_boundary_id(back ? 4 : front ? 5 : 0);
      }
}

/// The reason of an error of deal.II in one line.
std::string reason_of(const std::exception &error)
{
  std::ostringstream text;
  if (const auto *own = dynamic_cast<const dealii::ExceptionBase *>(&error))
    own->print_info(text);
  else
    text << error.what();
  std::istringstream words(text.str());
  std::string line;
  for (std::string word; words >> word;)
    line += (line.empty() ? "" : " ") + word;
  const auto end = line.find(". "); // the first sentence says what
  return line.substr(0, std::min<std::size_t>(end, 120));
}

/// What is wrong with a gmsh file and what is allowed, for the reason that deal.II gives.
std::string remedy(const std::string &reason, const int dim)
{
  const std::string cell = dim == 2 ? "quadrilaterals" : "hexahedra", face = dim == 2 ? "line" : "face";
  const auto says = [&reason](const char *part) { return reason.find(part) != std::string::npos; };
  if (says("boundary id for an internal face"))
    return "a physical group holds a " + face +
           " inside the body, allowed are groups of its boundary (gmsh: take it out of the group)";
  if (says("More than one tag"))
    return "an entity is in two physical groups, one is allowed";
  if (const auto place = reason.find("Element Identifier <"); place != std::string::npos)
  {
    static const std::map<int, std::string> names = {
      {2, "triangles"}, {4, "tetrahedra"}, {5, "hexahedra"}, {6, "wedges"}, {7, "pyramids"}};
    const auto name = names.find(std::atoi(reason.c_str() + place + 20));
    return "has " + (name == names.end() ? std::string("elements of second or higher order") : name->second) +
           ", allowed are " + cell + " of first order (gmsh: " + (name == names.end() ? "Mesh.ElementOrder = 1" : "recombine") +
           ")";
  }
  if (says("is not recognized at the present position"))
    return "is cut off, or holds a word where a number should stand";
  return "cannot be used as a mesh of dimension " + std::to_string(dim);
}

/// deal.II takes a cell that is listed twice for two cells.
template <int dim>
void check_listed_once(const std::string &file, const dealii::Triangulation<dim> &triangulation)
{
  std::set<std::array<unsigned int, q1::n_nodes<dim>>> known;
  for (const auto &cell : triangulation.active_cell_iterators())
  {
    std::array<unsigned int, q1::n_nodes<dim>> corners;
    for (int a = 0; a < q1::n_nodes<dim>; ++a)
      corners[a] = cell->vertex_index(a);
    std::sort(corners.begin(), corners.end());
    if (known.insert(corners).second)
      continue;
    std::ostringstream message;
    message << "mesh file '" << file << "': the cell at (" << cell->center() << ") m is listed twice, once is allowed";
    throw std::invalid_argument(message.str());
  }
}

template <int dim>
void read_gmsh(const std::string &file, dealii::Triangulation<dim> &triangulation)
{
  std::error_code ignored;
  if (std::filesystem::exists(file, ignored) && !std::filesystem::is_regular_file(file, ignored)) // reading a fifo would wait
    throw std::invalid_argument("mesh file '" + file + "': is not a file");
  std::ifstream stream(file);
  if (!stream)
    throw std::invalid_argument("mesh file '" + file + "': cannot be opened");
  const std::streamoff start = stream.get() == 0xEF && stream.get() == 0xBB && stream.get() == 0xBF ? 3 : 0;
  std::string word;
  double version = 0.;
  int binary = 0;
  stream.clear();
  stream.seekg(start); // behind a byte order mark
  if (!(stream >> word >> version >> binary) || word != "$MeshFormat")
    throw std::invalid_argument("mesh file '" + file + "': is not a gmsh mesh, which begins with $MeshFormat");
  if (binary != 0)
    throw std::invalid_argument("mesh file '" + file + "': is binary, allowed is text (gmsh: Mesh.Binary = 0)");
  stream.clear();
  stream.seekg(start);
  dealii::GridIn<dim> reader;
  reader.attach_triangulation(triangulation);
  stream.exceptions(std::ios::failbit | std::ios::badbit); // a reader that waits for the end of a cut list waits for ever
  try
  {
    reader.read_msh(stream);
  }
  catch (const std::ios_base::failure &)
  {
    throw std::invalid_argument("mesh file '" + file + "': is cut off, or holds a word where a number should stand");
  }
  catch (const std::exception &error)
  {
    const std::string reason = reason_of(error);
    throw std::invalid_argument("mesh file '" + file + "': " + remedy(reason, dim) + " [deal.II: " + reason + "]");
  }
  if (!triangulation.all_reference_cells_are_hyper_cube())
    throw std::invalid_argument("mesh file '" + file + "': has " + (dim == 2 ? "triangles" : "tetrahedra or wedges") +
                                ", allowed are " + (dim == 2 ? "quadrilaterals" : "hexahedra") + " (gmsh: recombine)");
  check_listed_once(file, triangulation);
}

template <int dim>
int target_level(const MeshSettings &settings, const dealii::BoundingBox<dim> &cell)
{
  int level = 0;
  for (const RefinedBox &box : settings.refined)
  {
    bool meets = true;
    for (int d = 0; d < dim; ++d)
    {
      // A cell that only touches the box is not refined.
      const double slack = 1e-6 * cell.side_length(d);
      meets = meets && cell.upper_bound(d) > box.lower[d] + slack && cell.lower_bound(d) < box.upper[d] - slack;
    }
    if (meets)
      level = std::max(level, box.levels);
  }
  return level;
}

/// The triangulation limits the difference of levels at vertices, so that the master of a hanging node is never a hanging node.
template <int dim>
void refine(const MeshSettings &settings, dealii::Triangulation<dim> &triangulation)
{
  for (const RefinedBox &box : settings.refined)
    for (int d = 0; d < dim; ++d)
      if (!(box.upper[d] > box.lower[d]))
        throw std::invalid_argument("mesh: the upper corner of a refined box must lie above the lower one in every direction");
  for (bool changed = !settings.refined.empty(); changed;)
  {
    changed = false;
    for (const auto &cell : triangulation.active_cell_iterators())
      if (cell->level() < target_level<dim>(settings, cell->bounding_box()))
      {
        cell->set_refine_flag();
        changed = true;
      }
    triangulation.execute_coarsening_and_refinement();
  }
}

/// The element needs an invertible map: positive Jacobians at the corners.
template <int dim>
void check_cells(const dealii::Triangulation<dim> &triangulation)
{
  constexpr int n = q1::n_nodes<dim>;
  for (const auto &cell : triangulation.active_cell_iterators())
  {
    q1::NodalValues<dim> X;
    for (int a = 0; a < n; ++a)
      for (int d = 0; d < dim; ++d)
        X(d, a) = cell->vertex(a)[d];
    for (int a = 0; a < n; ++a)
    {
      q1::Point<dim> corner;
      for (int d = 0; d < dim; ++d)
        corner[d] = (a >> d & 1) ? 1. : -1.;
      const Eigen::Matrix<double, dim, dim> J = X * q1::shape_derivatives<dim>(corner);
      if (!(J.determinant() > 0.))
      {
        std::ostringstream message;
        message << "mesh: the cell at ("
                << (X * q1::shape_values<dim>(q1::Point<dim>::Zero())).transpose().format({6, Eigen::DontAlignCols, ", "})
                << ") m is not convex or turned inside out";
        throw std::invalid_argument(message.str());
      }
    }
  }
}

/// Gives cells [first, last) to ranks [low, high). Each cut is across the longest extent and in proportion to the ranks.
template <int dim>
void bisect(const std::vector<dealii::Point<dim>> &centres, const std::vector<int>::iterator first,
            const std::vector<int>::iterator last, const int low, const int high, std::vector<int> &owner)
{
  if (high - low == 1 || first == last)
  {
    std::for_each(first, last, [&](const int cell) { owner[cell] = low; });
    return;
  }
  int direction = 0;
  double longest = -1.;
  for (int d = 0; d < dim; ++d)
  {
    const auto [a, b] = std::minmax_element(first, last, [&](int i, int j) { return centres[i][d] < centres[j][d]; });
    const double extent = centres[*b][d] - centres[*a][d];
    if (extent > longest * (1. + 1e-9))
    {
      longest = extent;
      direction = d;
    }
  }
  const int middle = (low + high) / 2;
  const auto cut = first + (last - first) * (middle - low) / (high - low);
  std::nth_element(first, cut, last,
                   [&](const int i, const int j) {
                     return centres[i][direction] != centres[j][direction] ? centres[i][direction] < centres[j][direction]
                                                                           : i < j;
                   });
  bisect<dim>(centres, first, cut, low, middle, owner);
  bisect<dim>(centres, cut, last, middle, high, owner);
}

template <int dim>
void partition(dealii::Triangulation<dim> &triangulation, const int n_ranks)
{
  std::vector<dealii::Point<dim>> centres;
  for (const auto &cell : triangulation.active_cell_iterators())
    centres.push_back(cell->center());
  std::vector<int> cells(centres.size()), owner(centres.size());
  std::iota(cells.begin(), cells.end(), 0);
  bisect<dim>(centres, cells.begin(), cells.end(), 0, n_ranks, owner);
  for (const auto &cell : triangulation.active_cell_iterators())
    cell->set_subdomain_id(owner[cell->active_cell_index()]);
}
} // namespace

template <int dim>
std::unique_ptr<dealii::parallel::shared::Triangulation<dim>> build_triangulation(MPI_Comm comm, const MeshSettings &settings)
{
  using Shared = dealii::parallel::shared::Triangulation<dim>;
  dealii::Triangulation<dim> serial(dealii::Triangulation<dim>::limit_level_difference_at_vertices);
  if (!settings.gmsh_file.empty())
    read_gmsh(settings.gmsh_file, serial);
  else if (settings.shape == MeshShape::disc)
    disc(settings, serial);
  else
    structured_box(settings, serial);
  refine(settings, serial);
  check_cells(serial);

  auto triangulation = std::make_unique<Shared>(comm, dealii::Triangulation<dim>::none, false, Shared::partition_custom_signal);
  const auto connection = triangulation->signals.create.connect(
    [&] { partition<dim>(*triangulation, dealii::Utilities::MPI::n_mpi_processes(comm)); });
  triangulation->copy_triangulation(serial);
  connection.disconnect();
  return triangulation;
}

template std::unique_ptr<dealii::parallel::shared::Triangulation<2>> build_triangulation<2>(MPI_Comm, const MeshSettings &);
template std::unique_ptr<dealii::parallel::shared::Triangulation<3>> build_triangulation<3>(MPI_Comm, const MeshSettings &);
} // namespace kerf::fem
