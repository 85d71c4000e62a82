// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/return_rule.h"

#include "coupler/base/mesh_geometry.h"
#include "coupler/base/mpi_helpers.h"
#include "coupler/method/activation/activation_rule.h"
#include "coupler/method/activation/stress_criterion.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>

namespace kerf
{
using Eigen::Vector3d;

namespace
{
/// Largest distance of two corners [m].
double extent_of(const fem::Mesh &mesh, int cell)
{
  double extent = 0.;
  for (int a = 0; a < mesh.cells.rows(); ++a)
    extent = std::max(extent, (mesh.nodes.col(mesh.cells(a, cell)) - mesh.nodes.col(mesh.cells(0, cell))).norm());
  return extent;
}
} // namespace

ReturnRule::ReturnRule(const Case &settings, const fem::Mesh &mesh, const dem::Packing &packing, VirialStress &cells,
                       MPI_Comm comm)
  : settings(settings), mesh(mesh), packing(packing), comm(comm), cells(cells), loaded_until(mesh.n_cells(), 0.)
{
}

bool ReturnRule::off() const
{
  return settings.activation.return_fraction == 0.;
}

/// Cells with a particle that has a broken bond, or that has left the domain.
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
                                             double time)
{
  constexpr int looks = 2; // in the set time
  next_look = time + settings.activation.return_time / looks;
  std::vector<char> converted(mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    converted[cell] = overlap.is_converted(cell);
  const std::vector<char> damaged = damaged_cells(fem, overlap, dem);
  const CellStresses stress = cells.stresses(converted, fem, dem, settings.rock.poisson);

  std::vector<char> stays(mesh.n_cells(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
  {
    const double measure = stress_measure(settings.activation.criterion, stress.col(cell), settings.activation.tensile_strength,
                                          settings.activation.compressive_strength);
    if (!converted[cell] || measure > settings.activation.return_fraction * settings.activation.sigma_star)
      loaded_until[cell] = time;
    stays[cell] = converted[cell] && (damaged[cell] || time - loaded_until[cell] < settings.activation.return_time);
  }
  // Damage in the overlap: what is around it stays as it is.
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

NodalState recover_nodes(const fem::FemSide &fem, dem::DemSide &dem, const dem::Packing &packing, const std::vector<int> &cells,
                         const Eigen::Matrix3Xd &moved, MPI_Comm comm)
{
  constexpr int record = 8; // index, mass of the particle, displacement, velocity
  const dem::Particles particles = dem.particles();
  std::vector<char> target(fem.mesh().n_cells(), 0);
  for (const int cell : cells)
    target[cell] = 1;
  Eigen::Matrix3Xd places(3, particles.n);
  for (int i = 0; i < particles.n; ++i)
    places.col(i) = packing.positions.col(particles.index[i]);
  const std::vector<fem::Interpolation> local = fem.locate(places);
  std::vector<double> values;
  for (int i = 0; i < particles.n; ++i)
    if (local[i].cell >= 0 && target[local[i].cell])
    {
      const Vector3d u = packing.displacement(particles.index[i], particles.position.col(i)), v = particles.velocity.col(i);
      values.insert(values.end(), {double(particles.index[i]), packing.volume(particles.index[i])});
      for (const Vector3d &field : {u, v})
        values.insert(values.end(), field.data(), field.data() + 3);
    }
  values = gather_all(values, MPI_DOUBLE, comm);
  std::vector<const double *> rows;
  for (std::size_t k = 0; k < values.size(); k += record)
    rows.push_back(&values[k]);
  std::sort(rows.begin(), rows.end(), [](const double *a, const double *b) { return a[0] < b[0]; });
  places.resize(3, rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k)
    places.col(k) = packing.positions.col(static_cast<int>(rows[k][0]));
  const std::vector<fem::Interpolation> found = fem.locate(places);

  NodalState state{fem.gather(fem::NodalField::displacement), fem.gather(fem::NodalField::velocity)};
  const Eigen::Matrix3Xd inverse_mass = fem.gather(fem::NodalField::inverse_mass);
  for (int c = 0; c < fem.mesh().dim; ++c)
  {
    std::vector<int> number(fem.mesh().n_nodes(), -1), nodes;
    for (const fem::Interpolation &point : found)
      for (int a = 0; a < point.n; ++a)
        if (const int node = point.nodes[a]; number[node] < 0 && moved(0, node) == 0. && inverse_mass(c, node) > 0.)
        {
          number[node] = static_cast<int>(nodes.size());
          nodes.push_back(node);
        }
    if (nodes.empty())
      continue;
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::MatrixX2d right = Eigen::MatrixX2d::Zero(nodes.size(), 2);
    for (std::size_t k = 0; k < found.size(); ++k)
    {
      const fem::Interpolation &point = found[k];
      Eigen::RowVector2d rest(rows[k][2 + c], rows[k][5 + c]);
      for (int a = 0; a < point.n; ++a)
        if (number[point.nodes[a]] < 0)
          rest -= point.N[a] * Eigen::RowVector2d(state.displacement(c, point.nodes[a]), state.velocity(c, point.nodes[a]));
      for (int a = 0; a < point.n; ++a)
        if (const int i = number[point.nodes[a]]; i >= 0)
        {
          const double weight = rows[k][1] * point.N[a];
          right.row(i) += weight * rest;
          for (int b = 0; b < point.n; ++b)
            if (const int j = number[point.nodes[b]]; j >= 0)
              entries.emplace_back(i, j, weight * point.N[b]);
        }
    }
    Eigen::SparseMatrix<double> matrix(nodes.size(), nodes.size());
    matrix.setFromTriplets(entries.begin(), entries.end());
    // A node that particles hardly see follows from the others: a trace of its own mean keeps the matrix definite.
    constexpr double trace = 1e-10;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      matrix.coeffRef(i, i) *= 1. + trace;
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
    const Eigen::MatrixX2d solution = solver.solve(right);
    for (std::size_t i = 0; i < nodes.size(); ++i)
    {
      state.displacement(c, nodes[i]) = solution(i, 0);
      state.velocity(c, nodes[i]) = solution(i, 1);
    }
  }
  return state;
}
} // namespace kerf
