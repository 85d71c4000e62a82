// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/activation/virial_stress.h"

#include <algorithm>

namespace kerf
{
const std::vector<int> &VirialStress::cells_of(const std::vector<char> &target, const fem::FemSide &fem)
{
  std::vector<int> unknown;
  for (int i = 0; i < packing.size(); ++i)
    if (target[i] && cell_of[i] == not_looked_up)
      unknown.push_back(i);
  Eigen::Matrix3Xd positions(3, unknown.size());
  for (std::size_t k = 0; k < unknown.size(); ++k)
    positions.col(k) = packing.positions.col(unknown[k]);
  const std::vector<fem::Interpolation> found = fem.locate(positions);
  for (std::size_t k = 0; k < unknown.size(); ++k)
    cell_of[unknown[k]] = found[k].cell;
  return cell_of;
}

CellStresses VirialStress::stresses(const std::vector<char> &target, const fem::FemSide &fem, const dem::DemSide &dem,
                                    double poisson)
{
  cells_of(dem.is_active(), fem);
  const auto cell = [&](int i) { return cell_of[i] >= 0 && target[cell_of[i]] ? cell_of[i] : -1; };
  CellStresses stress = CellStresses::Zero(6, mesh.n_cells());
  std::vector<char> inside(packing.size(), 0);
  for (int i = 0; i < packing.size(); ++i)
    inside[i] = dem.is_active()[i] && cell(i) >= 0;
  for (const dem::ActiveBond &bond : dem.bonds(inside))
  {
    const int cells[] = {cell(bond.first), cell(bond.second)};
    const Eigen::Matrix3d moment = 0.5 * packing.shortest(bond.b - bond.a) * bond.force.transpose();
    Eigen::Matrix<double, 6, 1> part;
    part << moment(0, 0), moment(1, 1), moment(2, 2), 0.5 * (moment(1, 2) + moment(2, 1)), 0.5 * (moment(0, 2) + moment(2, 0)),
      0.5 * (moment(0, 1) + moment(1, 0));
    for (const int c : cells)
      if (c >= 0)
        stress.col(c) += part;
  }
  MPI_Allreduce(MPI_IN_PLACE, stress.data(), static_cast<int>(stress.size()), MPI_DOUBLE, MPI_SUM, comm);

  Eigen::VectorXd volume = Eigen::VectorXd::Zero(mesh.n_cells());
  for (int i = 0; i < packing.size(); ++i)
    if (inside[i])
      volume[cell(i)] += packing.volume(i) / solid;
  for (int c = 0; c < mesh.n_cells(); ++c)
    if (volume[c] > 0.)
      stress.col(c) /= volume[c];
  if (mesh.dim == 2)
    stress.row(2) = poisson * (stress.row(0) + stress.row(1));
  return stress;
}
} // namespace kerf
