// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/activation_rule.h"

#include "coupler/base/errors.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/contact_criterion.h"
#include "coupler/method/activation/stress_criterion.h"

#include <algorithm>
#include <utility>

namespace kerf
{
ActivationRule::ActivationRule(const ActivationSettings &settings, const fem::Material &rock, const fem::Mesh &mesh,
                               MPI_Comm comm)
  : settings(settings), rock(rock), mesh(mesh), comm(comm)
{
}

Eigen::VectorXd ActivationRule::measures(const fem::FemSide &fem) const
{
  const fem::CellStress stress = fem.cell_stress();
  Eigen::VectorXd measure = Eigen::VectorXd::Zero(mesh.n_cells());
  for (std::size_t k = 0; k < stress.cell.size(); ++k)
    measure[stress.cell[k]] =
      stress_measure(settings.criterion, stress.sigma.col(k), settings.tensile_strength, settings.compressive_strength);
  MPI_Allreduce(MPI_IN_PLACE, measure.data(), mesh.n_cells(), MPI_DOUBLE, MPI_SUM, comm);
  return measure;
}

std::vector<int> ActivationRule::cells_to_convert(const fem::FemSide &fem, const Overlap &overlap,
                                                  const std::vector<NearCell> &below_tool) const
{
  const fem::CellStress stress = fem.cell_stress();
  std::vector<int> flagged, following;
  const double unloaded_norm =
    norm_below(settings.event_fraction * settings.sigma_star, settings.tensile_strength, settings.compressive_strength);
  for (std::size_t k = 0; k < stress.cell.size(); ++k)
  {
    if (!stress.sigma.col(k).allFinite())
      throw UnstableRun("the finite elements became unstable: stress of cell " + std::to_string(stress.cell[k]) +
                        " is not finite");
    const double distance = overlap.distance_of_cell(stress.cell[k]);
    // A cell in the outer half of the overlap waits for a later event. A cell outside the overlap starts a new particle region.
    const bool in_reach = distance <= 0.5 * overlap.width() || distance >= overlap.width();
    if (overlap.is_converted(stress.cell[k]) || !in_reach)
      continue;
    const double squared_norm = stress.sigma.col(k).head<3>().squaredNorm() + 2. * stress.sigma.col(k).tail<3>().squaredNorm();
    if (squared_norm <= unloaded_norm * unloaded_norm)
      continue; // rejects most cells without principal stresses
    const double measure =
      stress_measure(settings.criterion, stress.sigma.col(k), settings.tensile_strength, settings.compressive_strength);
    if (measure > settings.sigma_star)
      flagged.push_back(stress.cell[k]);
    else if (measure > settings.event_fraction * settings.sigma_star && distance < overlap.width())
      following.push_back(stress.cell[k]);
  }
  std::vector<int> cells = cells_below_tool(overlap, below_tool);
  flagged = gather_all(flagged, MPI_INT, comm);
  cells.insert(cells.end(), flagged.begin(), flagged.end());
  if (cells.empty())
    return cells;
  following = gather_all(following, MPI_INT, comm);
  cells.insert(cells.end(), following.begin(), following.end());
  return with_enclosed(std::move(cells), overlap);
}

std::vector<int> ActivationRule::cells_below_tool(const Overlap &overlap, const std::vector<NearCell> &below_tool) const
{
  std::vector<int> cells;
  if (settings.by_contact)
    for (const int cell : cells_too_coarse_for_contact(below_tool, settings.compressive_strength, rock, mesh))
      if (!overlap.is_converted(cell))
        cells.push_back(cell);
  return gather_all(cells, MPI_INT, comm);
}

/// The cells and those that they enclose with the particle region, ascending, each once.
std::vector<int> ActivationRule::with_enclosed(std::vector<int> cells, const Overlap &overlap) const
{
  std::vector<char> region(mesh.n_cells(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    region[cell] = overlap.is_converted(cell);
  for (const int cell : cells)
    region[cell] = 1;
  const std::vector<int> enclosed = enclose(mesh, region);
  cells.insert(cells.end(), enclosed.begin(), enclosed.end());
  std::sort(cells.begin(), cells.end());
  cells.erase(std::unique(cells.begin(), cells.end()), cells.end());
  return cells;
}

std::vector<int> enclose(const fem::Mesh &mesh, std::vector<char> &region)
{
  std::vector<int> cells;
  const auto look_at = [&](int cell)
  {
    if (region[cell])
      return;
    const std::vector<int> &neighbours = mesh.neighbours[cell];
    std::size_t outside = 0;
    for (const int neighbour : neighbours)
      outside += !region[neighbour];
    if (outside <= 1 && neighbours.size() > outside + 1)
    {
      region[cell] = 1;
      cells.push_back(cell);
    }
  };
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    look_at(cell);
  for (std::size_t k = 0; k < cells.size(); ++k) // the list grows
    for (const int neighbour : mesh.neighbours[cells[k]])
      look_at(neighbour);
  return cells;
}

} // namespace kerf
