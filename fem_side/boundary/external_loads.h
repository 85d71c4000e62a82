// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/boundary/surface.h"

#include <utility>

namespace kerf::fem
{
/// Forces that do not depend on the motion: weight, and tractions on boundary faces. Tractions refer to the reference area and
/// keep their direction.
template <int dim>
class ExternalLoads
{
public:
  /// @p first_piola: stress in equilibrium with the faces of kinds in_situ and absorbing [Pa]. Throws std::invalid_argument
  /// with one line on rollers that would have to hold a shear stress.
  ExternalLoads(const Mesh &mesh, const Settings &settings, const Eigen::Matrix3d &first_piola);

  /// Consistent nodal forces for the present weights of the faces. Gravity acts on the lumped masses. Collective.
  void assemble(const NodalSpace<dim> &space, const Surface<dim> &surface, const NodalVector &mass);
  /// Adds the forces at @p time [s] to the owned components.
  void add_forces(double time, double *f) const;
  /// Power on this rank [W] at @p time [s] with the velocities of the owned components.
  double power(double time, const double *v) const;

private:
  using Matrix = Eigen::Matrix<double, dim, dim>;
  struct Load
  {
    std::vector<char> faces;                          ///< of the mesh's boundary; empty: weight
    q1::Point<dim> traction = q1::Point<dim>::Zero(); ///< [Pa]; of weight: gravity [m/s^2]
    Matrix stress = Matrix::Zero();                   ///< adds stress times outer normal [Pa]
    double ramp = 0.;                                 ///< [s]
    bool held_before_start = false;                   ///< acts at any time, without ramp
    std::vector<std::pair<int, double>> forces;       ///< owned component, full force [N]

    double factor(double time) const { return held_before_start ? 1. : smooth_start(time, ramp); }
  };

  std::vector<Load> loads;
};
} // namespace kerf::fem
