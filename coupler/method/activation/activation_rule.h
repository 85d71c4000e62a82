// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/activation/activation_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Chooses the cells that become particles (Labra et al., eq. (5)): sigma > sigma*, the front advancing by at most half an
/// overlap width an event, and no cell left behind that is enclosed by particle region. Theory (7.6), (7.8).
class ActivationRule
{
public:
  ActivationRule(const ActivationSettings &settings, const fem::Mesh &mesh, MPI_Comm comm);

  /// Cells to convert now, sorted, the same list on every rank. Collective.
  std::vector<int> cells_to_convert(const fem::FemSide &fem, const Overlap &overlap) const;

  /// Stress measure of every mesh cell [Pa] (0 where there are no finite elements), the same on every rank. Collective.
  Eigen::VectorXd measures(const fem::FemSide &fem) const;

private:
  const ActivationSettings &settings;
  const fem::Mesh &mesh;
  MPI_Comm comm;
};

/// Adds cells to a region, one flag for each cell, until none outside has at most one neighbour outside: each could enclose the
/// next. Returns the cells that came in.
std::vector<int> enclose(const fem::Mesh &mesh, std::vector<char> &region);
} // namespace kerf
