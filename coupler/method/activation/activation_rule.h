// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/base/near_cell.h"
#include "coupler/method/activation/activation_settings.h"
#include "coupler/method/overlap/overlap.h"
#include "dem_side/dem_side.h"
#include "fem_side/fem_side.h"

#include <vector>

namespace kerf
{
/// Selects the cells to convert to particles: those with sigma > sigma* (Labra et al., eq. (5)). The front advances by at most
/// half an overlap width in one event. Cells below a tool that cannot resolve its contact are converted before it begins. Cells
/// that the particle region encloses are converted too. Theory (7.6), (7.8), (7.22).
class ActivationRule
{
public:
  ActivationRule(const ActivationSettings &settings, const fem::Material &rock, const fem::Mesh &mesh, MPI_Comm comm);

  /// Cells to convert now, sorted, the same on every rank. Throws UnstableRun when a stress is not finite. Collective.
  /// @param below_tool cells of this rank that a body touches before the next check
  std::vector<int> cells_to_convert(const fem::FemSide &fem, const Overlap &overlap,
                                    const std::vector<NearCell> &below_tool = {}) const;
  /// Those of them that are converted whatever their stress is. Collective.
  std::vector<int> cells_below_tool(const Overlap &overlap, const std::vector<NearCell> &below_tool) const;

  /// Stress measure of every mesh cell [Pa], zero in cells without finite elements, the same on every rank. Collective.
  Eigen::VectorXd measures(const fem::FemSide &fem) const;

private:
  std::vector<int> with_enclosed(std::vector<int> cells, const Overlap &overlap) const;

  const ActivationSettings &settings;
  const fem::Material &rock;
  const fem::Mesh &mesh;
  MPI_Comm comm;
};

/// Adds the cells that a region encloses, those with at most one neighbour outside. Every added cell can enclose another one,
/// so the search continues until there is none. @param region one flag for each cell. Returns the cells added.
std::vector<int> enclose(const fem::Mesh &mesh, std::vector<char> &region);
} // namespace kerf
