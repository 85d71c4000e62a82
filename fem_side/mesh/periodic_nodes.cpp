// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/periodic_nodes.h"

#include "fem_side/mesh/face_geometry.h"

#include <deal.II/numerics/rtree.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <sstream>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
constexpr double tolerance = 1e-9; ///< of the extent of the mesh

[[noreturn]] void fail(const int axis, const std::string &what)
{
  throw std::invalid_argument(std::string("mesh: periodic along ") + "xyz"[axis] + ": " + what);
}

/// The two opposite sides of the box around the mesh.
template <int dim>
class Sides
{
public:
  Sides(const Mesh &mesh, const int axis)
    : axis(axis), low(mesh.nodes.row(axis).minCoeff()), high(mesh.nodes.row(axis).maxCoeff()), mesh(mesh)
  {
    const Eigen::Vector3d extents = mesh.nodes.rowwise().maxCoeff() - mesh.nodes.rowwise().minCoeff();
    slack = tolerance * extents.maxCoeff();
    section = 1.;
    for (int d = 0; d < dim; ++d)
      section *= d == axis ? 1. : extents[d];
  }
  double extent() const { return high - low; }
  bool at_low(const int node) const { return mesh.nodes(axis, node) < low + slack; }
  bool at_high(const int node) const { return mesh.nodes(axis, node) > high - slack; }

  template <typename Side>
  bool holds(const BoundaryFace &face, const Side &side) const
  {
    return std::all_of(face.nodes.begin(), face.nodes.begin() + q1::n_nodes<dim - 1>, side);
  }
  bool holds(const BoundaryFace &face) const
  {
    return holds(face, [this](int node) { return at_low(node); }) || holds(face, [this](int node) { return at_high(node); });
  }

  /// Refuses sides that are not flat or smaller than the box.
  void check() const
  {
    double area = 0.;
    for (const BoundaryFace &face : mesh.boundary)
      if (holds(face))
        for (int p = 0; p < q1::n_nodes<dim - 1>; ++p)
          area += q1::area_vector<dim>(face_positions<dim>(mesh, face), q1::gauss_point<dim - 1>(p)).norm();
    if (std::abs(area - 2. * section) > 1e-6 * section)
      fail(axis, "the mesh has no two opposite flat sides, it must fill a box from side to side");
  }

  /// Every node of the high side with the opposite node of the low side.
  std::vector<std::pair<int, int>> pairs() const
  {
    std::vector<std::pair<dealii::Point<dim>, int>> lows;
    std::vector<int> highs;
    const auto flat = [this](const int node)
    {
      dealii::Point<dim> point;
      for (int d = 0; d < dim; ++d)
        point[d] = d == axis ? 0. : mesh.nodes(d, node);
      return point;
    };
    for (int node = 0; node < mesh.n_nodes(); ++node)
    {
      if (at_low(node))
        lows.emplace_back(flat(node), node);
      else if (at_high(node))
        highs.push_back(node);
    }
    const auto tree = dealii::pack_rtree(lows);
    std::vector<std::pair<int, int>> result;
    std::vector<std::pair<dealii::Point<dim>, int>> nearest;
    for (const int node : highs)
    {
      nearest.clear();
      tree.query(boost::geometry::index::nearest(flat(node), 1), std::back_inserter(nearest));
      if (lows.size() != highs.size() || nearest.front().first.distance(flat(node)) > slack)
      {
        std::ostringstream text;
        text << "the sides at " << low << " and " << high << " m have different nodes, let them match";
        fail(axis, text.str());
      }
      result.emplace_back(node, nearest.front().second);
    }
    return result;
  }

private:
  int axis;
  double low, high, slack, section;
  const Mesh &mesh;
};

/// Cells whose faces lie on each other become neighbours.
template <int dim>
void join_cells(const Sides<dim> &sides, const std::vector<int> &opposite, Mesh &mesh)
{
  std::map<std::array<int, 4>, int> cells; // by the face's nodes on the low side
  for (const BoundaryFace &face : mesh.boundary)
  {
    if (!sides.holds(face))
      continue;
    std::array<int, 4> nodes = {{-1, -1, -1, -1}};
    for (int a = 0; a < q1::n_nodes<dim - 1>; ++a)
      nodes[a] = opposite[face.nodes[a]];
    std::sort(nodes.begin(), nodes.end());
    const auto entry = cells.emplace(nodes, face.cell);
    if (entry.second)
      continue;
    const int other = entry.first->second;
    std::vector<int> &known = mesh.neighbours[other];
    if (std::find(known.begin(), known.end(), face.cell) == known.end()) // two cells from side to side meet twice
    {
      known.push_back(face.cell);
      mesh.neighbours[face.cell].push_back(other);
    }
  }
}
} // namespace

template <int dim>
std::vector<int> join_periodic_sides(const std::array<bool, 3> &axes, Mesh &mesh)
{
  std::vector<int> images(mesh.n_nodes());
  std::iota(images.begin(), images.end(), 0);
  for (int axis = 0; axis < 3; ++axis)
  {
    if (!axes[axis])
      continue;
    if (axis >= dim)
      fail(axis, "the mesh has two dimensions");
    const Sides<dim> sides(mesh, axis);
    sides.check();
    mesh.period[axis] = sides.extent();
    std::vector<int> opposite(mesh.n_nodes());
    std::iota(opposite.begin(), opposite.end(), 0);
    for (const auto &[high, low] : sides.pairs())
      opposite[high] = low;
    for (int &image : images) // a node on an edge of two joined sides is mapped across both in turn
      image = opposite[image];
    for (int cell = 0; cell < mesh.n_cells(); ++cell)
      for (int a = 0; a < mesh.cells.rows(); ++a)
        for (int b = 0; b < a; ++b)
          if (images[mesh.cells(a, cell)] == images[mesh.cells(b, cell)])
            fail(axis, "a cell reaches from one side to the other, at least two cells are needed");
    join_cells<dim>(sides, opposite, mesh);
    mesh.boundary.erase(
      std::remove_if(mesh.boundary.begin(), mesh.boundary.end(), [&](const BoundaryFace &face) { return sides.holds(face); }),
      mesh.boundary.end());
  }
  return images;
}

template std::vector<int> join_periodic_sides<2>(const std::array<bool, 3> &, Mesh &);
template std::vector<int> join_periodic_sides<3>(const std::array<bool, 3> &, Mesh &);
} // namespace kerf::fem
