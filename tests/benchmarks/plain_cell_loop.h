// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "tests/support/fem_cell_mesh.h"

namespace kerf::fem::benchmarks
{
/// Small-strain forces of fully integrated cells as one writes them by hand for the host's lanes: shape gradients of the
/// reference cell times a stored inverse Jacobian (one a cell where that is exact, else one a Gauss point), sums over nodes,
/// element by element gather and scatter in the caller's arrays.
template <int dim>
class PlainCellLoop
{
public:
  static constexpr int n = q1::n_nodes<dim>;

  PlainCellLoop(const test::CellMesh<dim> &mesh, const bool affine)
    : affine(affine), lambda(test::rock().lame_lambda()), mu(test::rock().lame_mu())
  {
    for (int q = 0; q < n; ++q)
      for (int a = 0; a < n; ++a)
        for (int d = 0; d < dim; ++d)
          reference[q][a][d] = q1::shape_derivatives<dim>(q1::gauss_point<dim>(q))(a, d);
    const int n_points = affine ? 1 : n;
    for (std::size_t c = 0; c < mesh.cells.size(); ++c)
    {
      const int lane = c % n_lanes;
      if (lane == 0)
      {
        nodes.emplace_back();
        geometry.resize(geometry.size() + n_points);
      }
      q1::NodalValues<dim> X;
      for (int a = 0; a < n; ++a)
        X.col(a) = mesh.X.col(mesh.cells[c][a]);
      for (int l = lane; l < n_lanes; ++l) // the last batch repeats its last cell without weight
        for (int a = 0; a < n; ++a)
          nodes.back()[a][l] = dim * mesh.cells[c][a];
      for (int q = 0; q < n_points; ++q)
      {
        const Eigen::Matrix<double, dim, dim> J =
          X * q1::shape_derivatives<dim>(affine ? q1::Point<dim>::Zero() : q1::gauss_point<dim>(q));
        const Eigen::Matrix<double, dim, dim> inverse = J.inverse();
        Point &point = geometry[geometry.size() - n_points + q];
        for (int l = lane; l < n_lanes; ++l)
        {
          for (int i = 0; i < dim; ++i)
            for (int j = 0; j < dim; ++j)
              point.inverse[i][j][l] = inverse(i, j);
          point.weight[l] = l == lane ? J.determinant() : 0.;
        }
      }
    }
  }

  /// f -= K u.
  void subtract_forces(const double *u, double *f) const
  {
    for (std::size_t b = 0; b < nodes.size(); ++b)
    {
      Lanes v[n][dim], r[n][dim] = {};
      for (int a = 0; a < n; ++a)
        for (int c = 0; c < dim; ++c)
          for (int l = 0; l < n_lanes; ++l)
            v[a][c][l] = u[nodes[b][a][l] + c];
      for (int q = 0; q < n; ++q)
        point(geometry[affine ? b : n * b + q], q, v, r);
      for (int a = 0; a < n; ++a)
        for (int l = 0; l < n_lanes; ++l)
          for (int c = 0; c < dim; ++c)
            f[nodes[b][a][l] + c] -= r[a][c][l];
    }
  }

private:
  struct Point
  {
    Lanes inverse[dim][dim];
    Lanes weight;
  };

  void point(const Point &point, const int q, const Lanes (&v)[n][dim], Lanes (&r)[n][dim]) const
  {
    Lanes D[dim][dim] = {}, H[dim][dim], stress[dim][dim];
    for (int a = 0; a < n; ++a)
      for (int c = 0; c < dim; ++c)
        for (int d = 0; d < dim; ++d)
          D[c][d] += v[a][c] * reference[q][a][d];
    for (int c = 0; c < dim; ++c)
      for (int j = 0; j < dim; ++j)
      {
        H[c][j] = D[c][0] * point.inverse[0][j];
        for (int d = 1; d < dim; ++d)
          H[c][j] += D[c][d] * point.inverse[d][j];
      }
    Lanes trace = H[0][0];
    for (int d = 1; d < dim; ++d)
      trace += H[d][d];
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        stress[i][j] = point.weight * (mu * (H[i][j] + H[j][i]) + (i == j ? 1. : 0.) * lambda * trace);
    for (int c = 0; c < dim; ++c)
      for (int d = 0; d < dim; ++d)
      {
        Lanes T = stress[c][0] * point.inverse[d][0];
        for (int j = 1; j < dim; ++j)
          T += stress[c][j] * point.inverse[d][j];
        for (int a = 0; a < n; ++a)
          r[a][c] += T * reference[q][a][d];
      }
  }

  bool affine;
  double lambda, mu;
  double reference[n][n][dim];
  std::vector<std::array<std::array<int, n_lanes>, n>> nodes;
  std::vector<Point> geometry;
};
} // namespace kerf::fem::benchmarks
