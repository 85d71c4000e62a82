// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/boundary/prescribed_motion.h"
#include "fem_side/boundary/surface.h"

namespace kerf::fem
{
/// Viscous boundary, traction -rho (c_p v_n + c_s v_t) (Lysmer & Kuhlemeyer 1969). It is lumped on nodes: f = -C v with one
/// dim x dim matrix C for each node. Both half kicks of one time level together give M (v+ - v-) = dt (f - C (v+ + v-)/2). This
/// is implicit in v+ and solved node by node, so that the dashpots do not lower the stable step.
template <int dim>
class AbsorbingBoundary
{
public:
  AbsorbingBoundary(const Mesh &mesh, const Material &material, const std::vector<BoundaryCondition> &conditions);

  /// Lumps the faces' dashpots on the nodes. Components in @p prescribed get none. Collective.
  void assemble(const NodalSpace<dim> &space, const Surface<dim> &surface, const std::vector<PrescribedDof> &prescribed,
                const NodalVector &mass);

  /// First half kick, before that of the other forces: v -= dt/2 C v/M.
  void begin_step(double dt, double *v);
  /// Energy absorbed in the first half of the drift [J]. @p v: half-step velocity [m/s].
  double energy_of_begin(double dt, const double *v) const;
  /// Second half kick, after that of the other forces: (M + dt/2 C) v = M v_in. Returns the energy absorbed in the second half
  /// of the drift [J]. keep_half_step_velocity() must have been called before the kick of the other forces.
  double end_step(double dt, double *v);
  void keep_half_step_velocity(const double *v);
  /// Contribution of the dashpots to Energies::finite_step, -dt^2/8 f^2/m, beside the other forces @p f [N]; in [J].
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
