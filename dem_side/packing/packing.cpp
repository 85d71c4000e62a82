// SPDX-License-Identifier: GPL-2.0-or-later
#include "dem_side/packing/packing.h"

#include "dem_side/geometry/cell_list.h"

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

Eigen::Vector3d Packing::wrapped(Eigen::Vector3d position) const
{
  for (int c = 0; c < 3; ++c)
    if (periodic[c] > 0.)
    {
      position[c] -= periodic[c] * std::floor((position[c] - lower[c]) / periodic[c]);
      // For a point just below the lower side, round-off may give the upper side, which belongs to the next box.
      if (position[c] >= upper[c] || position[c] < lower[c])
        position[c] = lower[c];
    }
  return position;
}

void bond_by_gap(Packing &packing, double gap_tolerance)
{
  packing.gap_tolerance = gap_tolerance;
  packing.bonds.clear();
  const int n = packing.size();
  if (n == 0)
    return;
  double sum = 0.; // not by Eigen's mean(), whose order of summation depends on the machine
  for (int i = 0; i < n; ++i)
    sum += packing.radii[i];
  const double largest_gap = gap_tolerance * sum / n;
  const CellList cells(packing.positions, 2. * packing.radii.maxCoeff() + largest_gap, packing.periodic);
  cells.for_each_pair(
    [&](int i, int j)
    {
      const double reach = packing.radii[i] + packing.radii[j] + largest_gap;
      const Eigen::Vector3d branch = packing.branch(i, j);
      const double square = branch[0] * branch[0] + branch[1] * branch[1] + branch[2] * branch[2];
      if (square < reach * reach)
        packing.bonds.push_back({i, j});
    });
  std::sort(packing.bonds.begin(), packing.bonds.end());
}
} // namespace kerf::dem
