// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing_generator.h"

#include <cmath>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
/// Rows along x, stacked along y, layers of them along z. Shifts are those of a row and of a layer against the one before,
/// taken alternately forth and back [diameters].
struct Stacking
{
  double row_height, layer_height;
  Eigen::Vector3d row_shift, layer_shift;
};

Stacking stacking_of(const std::string &kind)
{
  const double h = std::sqrt(0.75);
  if (kind == "hcp")
    return {h, std::sqrt(2. / 3.), {0.5, 0., 0.}, {0.5, h / 3., 0.}};
  // Cube axes of FCC: square layers at half a cube edge (sqrt(2) diameters), each in the hollows of the one before.
  const double half_edge = std::sqrt(0.5);
  if (kind == "fcc")
    return {half_edge, half_edge, {half_edge, 0., 0.}, {half_edge, 0., 0.}};
  return {h, 1., {0.5, 0., 0.}, Eigen::Vector3d::Zero()};
}
} // namespace

void place_lattice(Packing &packing, const Container &container)
{
  const double d = packing.mean_diameter, slack = 1e-9; // a box made for n particles must not lose one to round-off
  const Stacking stacking = stacking_of(packing.kind);
  const double spacing = packing.kind == "fcc" ? std::sqrt(2.) : 1.; // in a row
  const Eigen::Vector3d side = (container.upper() - container.lower()) / d;
  const auto steps = [slack](double room, double step)
  { return room < -slack ? 0 : static_cast<int>(room / step + slack) + 1; };

  std::vector<Eigen::Vector3d> centres; // in diameters from the first particle
  const int n_layers = packing.dim == 2 ? 1 : steps(side[2] - 1., stacking.layer_height);
  for (int layer = 0; layer < n_layers; ++layer)
  {
    const Eigen::Vector3d start = layer % 2 * stacking.layer_shift + layer * stacking.layer_height * Eigen::Vector3d::UnitZ();
    const int n_rows = steps(side[1] - 1. - start[1], stacking.row_height);
    for (int row = 0; row < n_rows; ++row)
    {
      // Two half shifts are a whole spacing in FCC and HCP: the row begins at the left again.
      double x = start[0] + row % 2 * stacking.row_shift[0];
      x -= x > spacing * (1. - slack) ? spacing : 0.;
      for (int k = 0, n = steps(side[0] - 1. - x, spacing); k < n; ++k)
        centres.emplace_back(x + k * spacing, start[1] + row * stacking.row_height, start[2]);
    }
  }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (const Eigen::Vector3d &x : centres)
  {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  const Eigen::Vector3d origin = (container.lower() + container.upper()) / 2. - d * (low + high) / 2.;
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d &x : centres)
  {
    const Eigen::Vector3d centre = origin + d * x;
    bool fits = container.is_box() || container.contains(centre);
    if (fits && !container.is_box())
      for (const Container::Wall &wall : container.walls(centre, 0.5 * d))
        fits = fits && wall.distance >= (0.5 - slack) * d;
    if (fits)
      kept.push_back(centre);
  }
  if (kept.empty())
    throw std::runtime_error("packing: no particle of the lattice fits into the surface");
  packing.positions.resize(3, kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i)
    packing.positions.col(i) = kept[i];
  if (packing.dim == 2)
    packing.positions.row(2).setZero();
  packing.radii.setConstant(kept.size(), d / 2.);
}
} // namespace kerf::dem
