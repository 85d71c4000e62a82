// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/generation/packing_generator.h"

#include <cmath>
#include <iomanip>
#include <limits>
#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
/// Rows of touching particles along the first axis are stacked along the second axis, and layers of rows along the third. The
/// shifts of a row or a layer against the one before alternate in sign [diameters].
struct Stacking
{
  double spacing, row_height, layer_height;
  Eigen::Vector3d row_shift, layer_shift;

  /// Periods of the lattice [diameters].
  Eigen::Vector3d period() const { return {spacing, 2. * row_height, 2. * layer_height}; }
};

Stacking stacking_of(const std::string &kind)
{
  const double h = std::sqrt(0.75);
  if (kind == "hcp")
    return {1., h, std::sqrt(2. / 3.), {0.5, 0., 0.}, {0.5, h / 3., 0.}};
  // FCC along its cube axes: square layers at distances of half a cube edge (edge: sqrt(2) diameters), each in the hollows of
  // the one before.
  const double half_edge = std::sqrt(0.5);
  if (kind == "fcc")
    return {2. * half_edge, half_edge, half_edge, {half_edge, 0., 0.}, {half_edge, 0., 0.}};
  return {1., h, 1., {0.5, 0., 0.}, Eigen::Vector3d::Zero()};
}

constexpr double slack = 1e-9; ///< so that a box for n particles does not lose one to round-off [diameters]

/// The part of one axis that the lattice fills. Coordinates in diameters.
struct Extent
{
  double from = 0., to = 0.; ///< coordinates of particles
  bool half_open = false;    ///< excludes to
  double scale = 1.;         ///< stretches the lattice to the box, whose side differs by round-off
  double place_of_zero = 0.; ///< in the box; of a centred lattice it follows from the particles
  bool centred = false;

  bool holds(double x) const { return x >= from - slack && (half_open ? x < to - slack : x <= to + slack); }
  int steps(double start, double step) const
  {
    return to < start - slack ? 0 : static_cast<int>((to - start) / step + slack) + 1;
  }
};

/// @param side of the box, @param plane_at distance of a plane of particles from its lower side [diameters]
Extent extent_of(double side, double period, bool periodic, double plane_at)
{
  Extent extent;
  if (periodic)
  {
    // Planes of particles are half a period apart. The boundary of the box is in the middle between two planes.
    extent.to = std::round(side / period) * period;
    extent.half_open = true;
    extent.scale = side / extent.to;
    extent.place_of_zero = 0.25 * period;
  }
  else if (!std::isnan(plane_at))
  {
    const double shift = std::ceil(plane_at / period - slack) * period;
    extent.place_of_zero = plane_at - shift; // at or below the lower side
    extent.from = -extent.place_of_zero;
    extent.to = extent.from + side;
    extent.half_open = true;
  }
  else
  {
    extent.to = side - 1.;
    extent.centred = true;
  }
  return extent;
}
} // namespace

std::string lattice_misfit(const PackingSettings &settings)
{
  const bool columns = settings.lattice.row_axis == 1;
  const Eigen::Vector3d period = stacking_of(settings.kind).period();
  for (int c = 0; c < settings.dim; ++c)
  {
    const double side = (settings.upper[c] - settings.lower[c]) / settings.mean_diameter, of_axis = period[columns ? 1 - c : c];
    if (settings.periodic[c] && std::abs(side - std::round(side / of_axis) * of_axis) > 1e-3)
    {
      std::ostringstream error;
      error << "side "
            << "xyz"[c] << " of the periodic box is " << side << " mean diameters long, the lattice needs a multiple of "
            << std::setprecision(10) << of_axis;
      return error.str();
    }
  }
  return "";
}

void place_lattice(Packing &packing, const Container &container)
{
  const double d = packing.mean_diameter;
  const Stacking stacking = stacking_of(packing.kind);
  const Eigen::Vector3d side = (container.upper() - container.lower()) / d, period = stacking.period();
  // Axis of the box along the rows, across them, across the layers.
  const int row_axis = packing.lattice.row_axis;
  const std::array<int, 3> axis = {{row_axis, 1 - row_axis, 2}};
  std::array<Extent, 3> extent;
  for (int k = 0; k < packing.dim; ++k)
    extent[k] =
      extent_of(side[axis[k]], period[k], packing.periodic[axis[k]] > 0.,
                axis[k] == 0 ? (packing.lattice.plane_at - packing.lower[0]) / d : std::numeric_limits<double>::quiet_NaN());

  std::vector<Eigen::Vector3d> centres; // from the first particle [diameters]
  const int n_layers = packing.dim == 2 ? 1 : extent[2].steps(0., stacking.layer_height);
  for (int layer = 0; layer < n_layers; ++layer)
  {
    const Eigen::Vector3d start = layer % 2 * stacking.layer_shift + layer * stacking.layer_height * Eigen::Vector3d::UnitZ();
    const int n_rows = extent[1].steps(start[1], stacking.row_height);
    for (int row = 0; row < n_rows; ++row)
    {
      // Two half shifts are a whole spacing in FCC and HCP. The row then begins at the left again.
      double x = start[0] + row % 2 * stacking.row_shift[0];
      x -= x > stacking.spacing * (1. - slack) ? stacking.spacing : 0.;
      for (int k = 0, n = extent[0].steps(x, stacking.spacing); k < n; ++k)
      {
        const Eigen::Vector3d centre(x + k * stacking.spacing, start[1] + row * stacking.row_height, start[2]);
        bool inside = true;
        for (int c = 0; c < packing.dim; ++c)
          inside = inside && extent[c].holds(centre[c]);
        if (inside)
          centres.push_back(centre);
      }
    }
  }
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e300), high = -low;
  for (const Eigen::Vector3d &x : centres)
  {
    low = low.cwiseMin(x);
    high = high.cwiseMax(x);
  }
  for (int k = 0; k < packing.dim; ++k)
    if (extent[k].centred)
      extent[k].place_of_zero = 0.5 * (side[axis[k]] - low[k] - high[k]);
  std::vector<Eigen::Vector3d> kept;
  for (const Eigen::Vector3d &x : centres)
  {
    Eigen::Vector3d centre = container.lower();
    for (int k = 0; k < packing.dim; ++k)
      centre[axis[k]] += d * extent[k].scale * (extent[k].place_of_zero + x[k]);
    bool fits = container.is_box() || container.contains(centre);
    if (fits && !container.is_box())
      for (const Container::Wall &wall : container.walls(centre, 0.5 * d))
        fits = fits && wall.distance >= (0.5 - slack) * d;
    if (fits)
      kept.push_back(centre);
  }
  if (kept.empty())
    throw std::invalid_argument("packing: no particle of the lattice fits into the surface");
  packing.positions.resize(3, kept.size());
  for (std::size_t i = 0; i < kept.size(); ++i)
    packing.positions.col(i) = kept[i];
  if (packing.dim == 2)
    packing.positions.row(2).setZero();
  packing.radii.setConstant(kept.size(), d / 2.);
}
} // namespace kerf::dem
