// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/overlap/overlap.h"

#include "coupler/base/mesh_geometry.h"
#include "coupler/method/overlap/weight_function.h"

#include <algorithm>
#include <cmath>

namespace kerf
{
namespace
{
Eigen::Matrix3Xd cell_centres(const fem::Mesh &mesh)
{
  Eigen::Matrix3Xd centres(3, mesh.n_cells());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    centres.col(cell) = cell_centre(mesh, cell);
  return centres;
}

std::vector<std::vector<int>> cells_by_node(const fem::Mesh &mesh)
{
  std::vector<std::vector<int>> cells(mesh.n_nodes());
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    for (int a = 0; a < mesh.cells.rows(); ++a)
      cells[mesh.cells(a, cell)].push_back(cell);
  return cells;
}

/// Distances below this fraction of the overlap width count as zero, because lattice and mesh coordinates have round-off.
constexpr double on_border = 1e-9;
} // namespace

Overlap::Overlap(const fem::Mesh &mesh, const Eigen::Matrix3Xd &quadrature_points, const Eigen::Matrix3Xd &surface_points,
                 const dem::Packing &packing, WeightFunction function, double width)
  : mesh(mesh), packing(packing), centres(cell_centres(mesh)), stored_bonds(packing), overlap_width(width), function(function),
    cells_of_node(cells_by_node(mesh)), converted(mesh.n_cells(), 0),
    particle_distance(mesh, packing.positions, width * (1. + 2. * on_border)),
    cell_distance(mesh, centres, width + 2. * packing.mean_diameter), particle_weight(Eigen::VectorXd::Zero(packing.size())),
    needed(packing.size(), 0)
{
  add_points(quadrature_points);
  add_points(surface_points);
  find_inside_parts();
}

void Overlap::find_inside_parts()
{
  inside_part = Eigen::VectorXd::Ones(packing.size());
  for (const fem::BoundaryFace &face : mesh.boundary)
  {
    Eigen::AlignedBox3d box;
    for (int a = 0; a < (mesh.dim == 2 ? 2 : 4); ++a)
      box.extend(mesh.nodes.col(face.nodes[a]));
    particle_distance.for_each_near(face.cell,
                                    [&](const int i, const Eigen::Vector3d &shift)
                                    {
                                      const Eigen::Vector3d place = packing.positions.col(i) - shift;
                                      const double radius = packing.radii[i];
                                      if (box.squaredExteriorDistance(place) < radius * radius)
                                        inside_part[i] =
                                          std::min(inside_part[i], 0.5 + 0.5 * distance_to_face(mesh, face, place) / radius);
                                    });
  }
}

int Overlap::add_points(const Eigen::Matrix3Xd &points)
{
  point_distances.emplace_back(mesh, points, overlap_width);
  return static_cast<int>(point_distances.size()) - 1;
}

void Overlap::convert(const std::vector<int> &cells)
{
  for (const int cell : cells)
    if (!converted[cell])
    {
      converted[cell] = 1;
      ++n_converted_cells;
      particle_distance.add_cell(cell);
      for (RegionDistance &distance : point_distances)
        distance.add_cell(cell);
      cell_distance.add_cell(cell);
    }
  find_particles();
}

void Overlap::restore(const std::vector<int> &cells)
{
  for (const int cell : cells)
    converted[cell] = 0;
  std::vector<int> left;
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (converted[cell])
    {
      left.push_back(cell);
      converted[cell] = 0;
    }
  n_converted_cells = 0;
  particle_distance.clear();
  cell_distance.clear();
  for (RegionDistance &distance : point_distances)
    distance.clear();
  convert(left);
}

/// Particles on the border of the particle region: in a converted cell and on one that is not converted.
std::vector<char> Overlap::on_region_border() const
{
  const double tolerance = on_border * overlap_width;
  std::vector<char> border(needed.size(), 0), seen(mesh.n_cells(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell)
    if (converted[cell])
      for (int a = 0; a < mesh.cells.rows(); ++a)
        for (const int other : cells_of_node[mesh.cells(a, cell)])
          if (!converted[other] && !seen[other])
          {
            seen[other] = 1;
            const Eigen::AlignedBox3d box = cell_box(mesh, other);
            particle_distance.for_each_near(other,
                                            [&](const int i, const Eigen::Vector3d &shift)
                                            {
                                              if (particle_distance.values()[i] > tolerance || border[i])
                                                return;
                                              const Eigen::Vector3d place = particle_distance.point(i) - shift;
                                              border[i] = box.squaredExteriorDistance(place) <= tolerance * tolerance &&
                                                          distance_to_cell(mesh, other, place) <= tolerance;
                                            });
          }
  return border;
}

/// Share of a tied particle, see TiedParticle. In a uniform stress the weighted bonds of particle i exert the force sum_j (w_j
/// - w_i)/2 f_ij on it. The bond forces f_ij act mainly along the branches x_ij. The change of linear weights follows the
/// distance phi, which is constant outside the overlap. A particle whose centre lies on the boundary stands for half of its
/// place. Theory (4.5).
double Overlap::share_of(const int particle) const
{
  const auto depth = [&](int i) { return std::clamp(particle_distance.values()[i], 0., overlap_width); };
  Eigen::Vector3d change = Eigen::Vector3d::Zero();
  for (const int partner : stored_bonds.partners_of(particle))
    change += (depth(partner) - depth(particle)) * packing.branch(particle, partner);
  const double size = change.norm();
  if (size == 0.)
    return 0.;
  double whole = 0.; // the same sum well inside the overlap, where the depth varies linearly
  for (const int partner : stored_bonds.partners_of(particle))
    whole += std::pow(packing.branch(particle, partner).dot(change) / size, 2);
  return inside_part[particle] * std::min(1., size / whole);
}

void Overlap::find_particles()
{
  ++changes;
  const Eigen::VectorXd &phi = particle_distance.values();
  const double tolerance = on_border * overlap_width;
  const std::vector<char> border = on_region_border();
  tied.clear();
  for (int i = 0; i < phi.size(); ++i)
  {
    const bool inside = phi[i] < overlap_width - tolerance;
    particle_weight[i] = inside ? 1. - fe_weight(function, phi[i] <= tolerance ? 0. : phi[i], overlap_width) : 0.;
    needed[i] = inside;
  }
  for (int i = 0; i < phi.size(); ++i)
  {
    if (particle_weight[i] == 0.)
      for (const int partner : stored_bonds.partners_of(i))
        needed[i] = needed[i] || particle_weight[partner] > 0.;
    if (!needed[i])
      continue;
    if (particle_weight[i] == 0. || border[i] || phi[i] > tolerance)
      if (const double share = share_of(i); share > 0.)
        tied.push_back({i, share});
  }
}

Eigen::VectorXd Overlap::fe_weights_at(const int number) const
{
  return point_distances[number].values().unaryExpr([this](double phi) { return fe_weight(function, phi, overlap_width); });
}
} // namespace kerf
