// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/boundary/prescribed_motion.h"
#include "fem_side/boundary/surface.h"

namespace kerf::fem
{
/// Viscous boundary, traction -rho (c_p v_n + c_s v_t) (Lysmer & Kuhlemeyer 1969), lumped on nodes: f = -C v with one small
/// matrix a node. The velocity is that of the end of the step, solved node by node, so that the dashpots do not lower the
/// stable step: both half kicks of one time level together give M (v+ - v-) = dt (f - C (v+ + v-)/2).
template <int dim>
class AbsorbingBoundary
{
public:
  AbsorbingBoundary(const Mesh &mesh, const Material &material, const std::vector<BoundaryCondition> &conditions);

  /// Lumps the faces' dashpots on the nodes; components in @p prescribed stay out. Collective.
  void assemble(const NodalSpace<dim> &space, const Surface<dim> &surface, const std::vector<PrescribedDof> &prescribed,
                const NodalVector &mass);

  /// First half kick, before that of the other forces: v -= dt/2 C v/M.
  void begin_step(double dt, double *v);
  /// Energy taken in the first half of the drift [J]; v: half-step velocity.
  double energy_of_begin(double dt, const double *v) const;
  /// Second half kick, after that of the other forces: (M + dt/2 C) v = M v_in. Returns the energy taken in the second half of
  /// the drift [J]; @p half_step_velocity() must have been called before the other forces' kick.
  double end_step(double dt, double *v);
  void keep_half_step_velocity(const double *v);
  /// What the dashpots add to the energy of the finite step, -dt^2/8 f^2/m (see Energies), beside the other forces @p f [J].
  double finite_step_energy(double dt, const double *f) const;

private:
  using Matrix = Eigen::Matrix<double, dim, dim>;
  struct Dashpot
  {
    int dof = 0;
    double mass = 0.;                              ///< [kg]
    Matrix C = Matrix::Zero();                     ///< [N s/m]
    q1::Point<dim> force = q1::Point<dim>::Zero(); ///< at the last full time level [N]
    q1::Point<dim> half_step_velocity = q1::Point<dim>::Zero();
  };

  Material material;
  bool any = false;
  std::vector<char> absorbs; ///< by face of the mesh's boundary
  std::vector<Dashpot> dashpots;
};
} // namespace kerf::fem
