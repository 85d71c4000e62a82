// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/return_rule.h"

#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/activation_rule.h"
#include "coupler/method/activation/stress_criterion.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
/// Size of a cell: largest distance of a corner from the first one [m].
double extent_of(const fem::Mesh &mesh, int cell)
{
  double extent = 0.;
  for (int a = 0; a < mesh.cells.rows(); ++a)
    extent = std::max(extent, (mesh.nodes.col(mesh.cells(a, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return extent;
}
} // namespace

ReturnRule::ReturnRule(const ActivationSettings &settings, double poisson, const fem::Mesh &mesh, const dem::Packing &packing,
                       VirialStress &cells, MPI_Comm comm)
  : settings(settings), poisson(poisson), mesh(mesh), packing(packing), comm(comm), cells(cells),
    loaded_until(mesh.n_cells(), 0.)
{
}

bool ReturnRule::off() const
{
  return settings.return_fraction == 0.;
}

/// Cells with a particle that has a broken bond or has left the domain.
std::vector<char> ReturnRule::damaged_cells(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem)
{
  std::vector<char> taking_part(packing.size());
  for (int i = 0; i < packing.size(); ++i)
    taking_part[i] = overlap.needs_particle(i);
  const std::vector<int> &cell_of = cells.cells_of(taking_part, fem);
  std::vector<int> ends;
  for (const dem::BrokenBond &bond : dem.broken_bonds())
    ends.insert(ends.end(), {bond.first, bond.second});
  ends = gather_all(ends, MPI_INT, comm);
  std::vector<char> damaged(mesh.n_cells(), 0);
  for (const int i : ends)
    if (cell_of[i] >= 0)
      damaged[cell_of[i]] = 1;
  for (int i = 0; i < packing.size(); ++i)
    if (overlap.needs_particle(i) && !dem.is_active()[i] && cell_of[i] >= 0)
      damaged[cell_of[i]] = 1;
  return damaged;
}

std::vector<int> ReturnRule::cells_to_return(const fem::FemSide &fem, const Overlap &overlap, const dem::DemSide &dem,
                                             double time, const std::vector<int> &below_tool)
{
  constexpr int looks = 2; // checks in the return time
  next_look = time + settings.return_time / looks;
  std::vector<char> converted(mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    converted[cell] = overlap.is_converted(cell);
  const std::vector<char> damaged = damaged_cells(fem, overlap, dem);
  const CellStresses stress = cells.stresses(converted, fem, dem, poisson);

  std::vector<char> stays(mesh.n_cells(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
  {
    const double measure =
      stress_measure(settings.criterion, stress.col(cell), settings.tensile_strength, settings.compressive_strength);
    if (!converted[cell] || measure > settings.return_fraction * settings.sigma_star)
      loaded_until[cell] = time;
    stays[cell] = converted[cell] && (damaged[cell] || time - loaded_until[cell] < settings.return_time);
  }
  for (const int cell : below_tool)
    stays[cell] = converted[cell];
  // Particle cells around damage in the overlap do not return.
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (damaged[cell] && !converted[cell])
    {
      const Vector3d centre = cell_centre(mesh, cell);
      const double around = overlap.width() + extent_of(mesh, cell);
      for (int other = 0; other < mesh.n_cells(); ++other)
        stays[other] = stays[other] || (converted[other] && (cell_centre(mesh, other) - centre).norm() < around);
    }
  enclose(mesh, stays);

  std::vector<int> returning;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (converted[cell] && !stays[cell])
      returning.push_back(cell);
  return returning;
}
} // namespace kerf
