// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing.h"

#include "dem_side/cell_list.h"

namespace kerf::dem
{
namespace
{
constexpr double pi = 3.14159265358979323846;
} // namespace

double Packing::volume(int i) const
{
  const double r = radii[i];
  return dim == 2 ? pi * r * r : 4. / 3. * pi * r * r * r;
}

double box_volume(int dim, const Eigen::Vector3d &lower, const Eigen::Vector3d &upper)
{
  double volume = 1.;
  for (int c = 0; c < dim; ++c)
    volume *= upper[c] - lower[c];
  return volume;
}

double Packing::solid_fraction() const
{
  double solid = 0.;
  for (int i = 0; i < size(); ++i)
    solid += volume(i);
  return solid / (volume_filled > 0. ? volume_filled : box_volume(dim, lower, upper));
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
} // namespace kerf::dem
