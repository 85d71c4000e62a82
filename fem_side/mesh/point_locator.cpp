// SPDX-License-Identifier: GPL-2.0-or-later
#include "fem_side/mesh/point_locator.h"

#include <deal.II/numerics/rtree.h>

#include <Eigen/Dense>
#include <algorithm>
#include <limits>
#include <stdexcept>

namespace kerf::fem
{
namespace
{
/// How far a point may lie outside a cell [-1, 1]^dim and still belong to it; covers round-off on faces.
constexpr double face_tolerance = 2e-9;

/// Newton's method for X(xi) = point. False if it does not converge, which happens only outside the cell.
template <int dim>
bool invert(const q1::NodalValues<dim> &X, const q1::Point<dim> &point, q1::Point<dim> &xi)
{
  // Far from the origin the last bit of a coordinate is more than the smallest step.
  const double round_off = 8. * std::numeric_limits<double>::epsilon() * X.cwiseAbs().maxCoeff();
  xi.setZero();
  for (int i = 0; i < 20; ++i)
  {
    const Eigen::Matrix<double, dim, dim> inverse = (X * q1::shape_derivatives<dim>(xi)).inverse();
    const q1::Point<dim> step = inverse * (point - X * q1::shape_values<dim>(xi));
    if (!step.allFinite() || step.norm() > 1e3)
      return false;
    xi += step;
    if (step.norm() < std::max(1e-12, round_off * inverse.norm()))
      return true;
  }
  return false;
}

void add_node(Interpolation &result, const int node, const double N, const Eigen::Vector3d &dN)
{
  int a = 0;
  while (a < result.n && result.nodes[a] != node)
    ++a;
  if (a == result.n)
  {
    // The masters of a cell's slaves are at most as many as its slaves, see refine() in mesh_builder.cpp.
    if (result.n == static_cast<int>(result.nodes.size()))
      throw std::logic_error("point_locator: a cell depends on more nodes than it has");
    result.nodes[result.n++] = node;
  }
  result.N[a] += N;
  result.dN.col(a) += dN;
}

template <int dim>
Interpolation interpolation(const NodalSpace<dim> &space, const int cell, const q1::NodalValues<dim> &X,
                            const q1::Point<dim> &xi)
{
  const auto D = q1::shape_derivatives<dim>(xi);
  const auto N = q1::shape_values<dim>(xi);
  const Eigen::Matrix<double, dim, dim> inverse = (X * D).inverse();
  Interpolation result;
  result.cell = cell;
  for (int d = 0; d < dim; ++d)
    result.xi[d] = 0.5 * (1. + xi[d]);
  for (int a = 0; a < q1::n_nodes<dim>; ++a)
  {
    const int node = space.mesh.cells(a, cell);
    Eigen::Vector3d dN = Eigen::Vector3d::Zero();
    dN.template head<dim>() = inverse.transpose() * D.row(a).transpose();
    if (!space.is_slave(node))
      add_node(result, node, N[a], dN);
    else
    {
      const SlaveNode &slave = space.slave(node);
      for (std::size_t k = 0; k < slave.masters.size(); ++k)
        add_node(result, slave.masters[k], slave.weights[k] * N[a], slave.weights[k] * dN);
    }
  }
  return result;
}
} // namespace

template <int dim>
struct PointLocator<dim>::Tree
{
  using Box = dealii::BoundingBox<dim>;

  dealii::RTree<std::pair<Box, int>> boxes; ///< with the number of the cell
};

template <int dim>
PointLocator<dim>::~PointLocator() = default;

template <int dim>
PointLocator<dim>::PointLocator(const NodalSpace<dim> &space) : space(space)
{
  lower = space.mesh.nodes.rowwise().minCoeff();
  using Box = typename Tree::Box;
  std::vector<std::pair<Box, int>> boxes;
  for (int cell = 0; cell < space.mesh.n_cells(); ++cell)
  {
    const q1::NodalValues<dim> X = space.cell_nodes(cell);
    const q1::Point<dim> lower = X.rowwise().minCoeff(), upper = X.rowwise().maxCoeff();
    const double margin = face_tolerance * (upper - lower).maxCoeff();
    dealii::Point<dim> a, b;
    for (int d = 0; d < dim; ++d)
    {
      a[d] = lower[d] - margin;
      b[d] = upper[d] + margin;
    }
    boxes.emplace_back(Box({a, b}), cell);
  }
  tree = std::make_unique<const Tree>(Tree{dealii::pack_rtree(boxes)});
}

template <int dim>
std::vector<Interpolation> PointLocator<dim>::locate(const Eigen::Matrix3Xd &points) const
{
  constexpr std::size_t most_known = 100000; // 35 MB; a whole packing is located only once
  const bool keep = static_cast<std::size_t>(points.cols()) < most_known;
  std::vector<Interpolation> result(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i)
  {
    const Point key = {points(0, i), points(1, i), points(2, i)};
    if (const auto found = known.find(key); found != known.end())
    {
      result[i] = found->second;
      continue;
    }
    result[i] = find(points.col(i));
    if (known.size() >= most_known)
      known.clear();
    if (keep)
      known.emplace(key, result[i]);
  }
  return result;
}

template <int dim>
Interpolation PointLocator<dim>::find(const Eigen::Vector3d &place) const
{
  q1::Point<dim> point = place.template head<dim>();
  for (int d = 0; d < dim; ++d)
    if (space.mesh.period[d] > 0.)
      point[d] -= space.mesh.period[d] * std::floor((point[d] - lower[d]) / space.mesh.period[d]);
  dealii::Point<dim> p;
  for (int d = 0; d < dim; ++d)
    p[d] = point[d];
  std::vector<std::pair<typename Tree::Box, int>> candidates;
  tree->boxes.query(boost::geometry::index::intersects(p), std::back_inserter(candidates));

  Interpolation result;
  double best = 1. + face_tolerance;
  for (const auto &candidate : candidates)
  {
    const q1::NodalValues<dim> X = space.cell_nodes(candidate.second);
    q1::Point<dim> xi;
    if (!invert<dim>(X, point, xi))
      continue;
    // A point on a face belongs to its first cell, whatever the round-off: gradients of the cells differ.
    const double outermost = xi.cwiseAbs().maxCoeff();
    const bool on_shared_face = result.cell >= 0 && std::abs(outermost - best) < 2. * face_tolerance;
    if (on_shared_face ? candidate.second > result.cell : !(outermost < best))
      continue;
    best = outermost;
    result = interpolation<dim>(space, candidate.second, X, xi);
  }
  return result;
}

template class PointLocator<2>;
template class PointLocator<3>;
} // namespace kerf::fem
