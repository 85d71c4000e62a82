// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing.h"

#include "dem_side/cell_list.h"
#include "dem_side/packing_generator.h"

#include <sstream>
#include <stdexcept>

namespace kerf::dem
{
namespace
{
constexpr double pi = 3.14159265358979323846;

void check(const PackingSettings &settings)
{
  std::ostringstream error;
  if (settings.kind != "random" && settings.kind != "triangular")
    error << "packing: kind '" << settings.kind << "' is unknown, use random or triangular";
  else if (settings.dim != 2)
    error << "packing: only 2 dimensions can be generated so far, not " << settings.dim;
  else if (!(settings.mean_diameter > 0.) || !std::isfinite(settings.mean_diameter))
    error << "packing: the mean diameter must be positive, not " << settings.mean_diameter;
  else if (!(settings.radius_spread >= 0. && settings.radius_spread <= 0.8))
    error << "packing: the radius spread must be in [0, 0.8], not " << settings.radius_spread;
  else if (!(settings.gap_tolerance >= 0. && settings.gap_tolerance <= 2.))
    error << "packing: the gap tolerance must be in [0, 2] mean radii, not " << settings.gap_tolerance;
  else
    for (int c = 0; c < settings.dim; ++c)
    {
      const double sides = (settings.upper[c] - settings.lower[c]) / settings.mean_diameter;
      if (!(sides >= 4.) || !(sides <= 1e5))
      {
        error << "packing: side "
              << "xyz"[c] << " of the box is " << sides << " mean diameters long, it must be 4 to 100000";
        break;
      }
    }
  if (!error.str().empty())
    throw std::runtime_error(error.str());
}

/// Rows along x at distance sqrt(3)/2 d, every second one shifted by d/2; the block is centred in the box.
void place_triangular(Packing &packing, double d)
{
  const double width = packing.upper[0] - packing.lower[0], height = packing.upper[1] - packing.lower[1];
  const double row_height = std::sqrt(3.) / 2. * d;
  const double slack = 1e-9; // a box made for n discs must not lose one to round-off
  const int n_row = static_cast<int>(width / d + slack);
  const int n_shifted = (n_row + 0.5) * d <= width + slack * d ? n_row : n_row - 1;
  const int n_rows = static_cast<int>((height - d) / row_height + slack) + 1;

  const double block_width = std::max(n_row * d, (n_shifted + 0.5) * d);
  const double x0 = packing.lower[0] + (width - block_width + d) / 2.;
  const double y0 = packing.lower[1] + (height - (n_rows - 1) * row_height) / 2.;
  const int n = (n_rows + 1) / 2 * n_row + n_rows / 2 * n_shifted;
  packing.positions.setZero(3, n);
  packing.radii.setConstant(n, d / 2.);
  for (int row = 0, i = 0; row < n_rows; ++row)
    for (int k = 0; k < (row % 2 ? n_shifted : n_row); ++k, ++i)
      packing.positions.col(i) << x0 + (k + row % 2 * 0.5) * d, y0 + row * row_height, 0.;
}
} // namespace

double Packing::volume(int i) const
{
  const double r = radii[i];
  return dim == 2 ? pi * r * r : 4. / 3. * pi * r * r * r;
}

double Packing::solid_fraction() const
{
  double solid = 0.;
  for (int i = 0; i < size(); ++i)
    solid += volume(i);
  return solid / (upper - lower).head(dim).prod();
}

double Packing::coordination() const
{
  return size() ? 2. * double(bonds.size()) / size() : 0.;
}

void bond_by_gap(Packing &packing, double gap_tolerance)
{
  packing.gap_tolerance = gap_tolerance;
  packing.bonds.clear();
  const int n = packing.size();
  if (n == 0)
    return;
  double sum = 0.; // not Eigen's mean(): its order of summation depends on the machine
  for (int i = 0; i < n; ++i)
    sum += packing.radii[i];
  const double largest_gap = gap_tolerance * sum / n;
  const CellList cells(packing.positions, 2. * packing.radii.maxCoeff() + largest_gap);
  cells.for_each_pair(
    [&](int i, int j)
    {
      const double reach = packing.radii[i] + packing.radii[j] + largest_gap;
      double square = 0.;
      for (int c = 0; c < 3; ++c)
      {
        const double d = packing.positions(c, j) - packing.positions(c, i);
        square += d * d;
      }
      if (square < reach * reach)
        packing.bonds.push_back({i, j});
    });
  std::sort(packing.bonds.begin(), packing.bonds.end());
}

Packing generate_packing(const PackingSettings &settings, const Progress &progress)
{
  check(settings);
  Packing packing;
  packing.dim = settings.dim;
  packing.kind = settings.kind;
  packing.lower = settings.lower;
  packing.upper = settings.upper;
  if (settings.dim == 2)
    packing.lower[2] = packing.upper[2] = 0.;

  if (settings.kind == "triangular")
  {
    packing.mean_diameter = settings.mean_diameter;
    place_triangular(packing, settings.mean_diameter);
    // Nearest neighbours have gap 0 (+- round-off), second neighbours 1.46 r.
    bond_by_gap(packing, std::clamp(settings.gap_tolerance, 1e-6, 0.5));
  }
  else
  {
    packing.seed = settings.seed;
    generate_random(packing, settings, progress);
  }
  if (progress)
  {
    std::ostringstream text;
    text << packing.size() << " particles, " << packing.bonds.size() << " bonds, solid fraction " << packing.solid_fraction();
    progress(1., text.str());
  }
  return packing;
}
} // namespace kerf::dem
