// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <functional>
#include <memory>

namespace kerf::fem::benchmarks
{
/// Small-strain forces of fully integrated cells by deal.II's own matrix-free evaluation (MatrixFree, FEEvaluation), as the
/// library is installed, on a block of cells of size 1 whose inner nodes are moved by up to @p distortion in each direction.
template <int dim>
class StockMatrixFree
{
public:
  StockMatrixFree(const int (&n_cells)[dim], double distortion);
  ~StockMatrixFree();

  int n_lanes() const; ///< of the library's vectorised type
  int n_cells() const;
  void apply(); ///< y = K x

private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation;
};
} // namespace kerf::fem::benchmarks
