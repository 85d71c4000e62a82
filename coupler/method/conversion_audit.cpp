// SPDX-License-Identifier: GPL-2.0-or-later
#include "coupler/method/conversion_audit.h"

#include "dem_side/bond/bond_kinematics.h"

#include <Eigen/Geometry>
#include <cmath>

namespace kerf
{
ConservedQuantities conserved_quantities(const fem::FemSide &fem, dem::DemSide &dem, const EnergyLedger &energies,
                                         MPI_Comm comm)
{
  using Eigen::Vector3d;
  const dem::Particles particles = dem.particles();
  Eigen::Matrix<double, 7, 1> sums = Eigen::Matrix<double, 7, 1>::Zero(); // mass, momentum, angular momentum
  for (int i = 0; i < particles.n; ++i)
  {
    const Vector3d momentum = particles.mass[i] * particles.velocity.col(i), x = particles.position.col(i);
    const double inertia = dem::inertia_factor(fem.mesh().dim) * particles.mass[i] * particles.radius[i] * particles.radius[i];
    sums[0] += particles.mass[i];
    sums.segment<3>(1) += momentum;
    sums.tail<3>() += x.cross(momentum) + inertia * particles.angular_velocity.col(i);
  }
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), 7, MPI_DOUBLE, MPI_SUM, comm);
  if (fem.n_active_cells() > 0)
  {
    const Eigen::Matrix3Xd mass = fem.gather(fem::NodalField::mass), velocity = fem.gather(fem::NodalField::velocity),
                           displacement = fem.gather(fem::NodalField::displacement);
    for (int a = 0; a < fem.mesh().n_nodes(); ++a)
    {
      const Vector3d momentum = mass(0, a) * velocity.col(a), x = fem.mesh().nodes.col(a) + displacement.col(a);
      sums[0] += mass(0, a);
      sums.segment<3>(1) += momentum;
      sums.tail<3>() += x.cross(momentum);
    }
  }
  ConservedQuantities quantities;
  quantities.mass = sums[0];
  quantities.momentum = sums.segment<3>(1);
  quantities.angular_momentum = sums.tail<3>();
  quantities.kinetic = energies.kinetic;
  quantities.elastic = energies.elastic;
  quantities.bonds = dem.n_bonds_intact() + dem.n_bonds_broken();
  return quantities;
}
void compare_stresses(ActivationEvent &event, const CellStresses &before, const CellStresses &after)
{
  const auto root_mean_square = [](const CellStresses &stress)
  { return std::sqrt((stress.topRows<3>().squaredNorm() + 2. * stress.bottomRows<3>().squaredNorm()) / stress.cols()); };
  event.stress = root_mean_square(before);
  event.stress_jump = root_mean_square(after - before);
}
} // namespace kerf
