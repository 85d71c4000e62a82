// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/boundary/absorbing_boundary.h"
#include "fem_side/boundary/external_loads.h"
#include "fem_side/boundary/prescribed_motion.h"
#include "fem_side/boundary/surface.h"
#include "fem_side/element/cell_kernel.h"
#include "fem_side/fem_side.h"
#include "fem_side/mesh/nodal_space.h"
#include "fem_side/mesh/nodal_window.h"
#include "fem_side/mesh/point_locator.h"

#include <cstdint>
#include <memory>

namespace kerf::fem
{
/// Multilinear elements with lumped mass, total Lagrangian, central differences.
template <int dim>
class ExplicitSolver final : public FemSide
{
public:
  /// Collective.
  explicit ExplicitSolver(const Settings &settings);

  const Mesh &mesh() const override { return space.mesh; }
  const Eigen::Matrix3Xd &quadrature_points() const override { return points; }
  const Eigen::Matrix3Xd &surface_positions() const override { return surface.all_points(); }
  const std::vector<int> &owned_cells() const override { return space.owned_cells; }
  std::vector<Interpolation> locate(const Eigen::Matrix3Xd &points) const override { return locator.locate(points); }

  void set_weights(const Eigen::VectorXd &alpha, const Eigen::VectorXd &surface_alpha) override;
  int n_active_cells() const override { return n_active; }

  void begin_step(double dt, double time) override;
  void compute_forces() override;
  void end_step(double dt, double time) override;

  void set_window(const std::vector<int> &nodes) override;
  void read_window(NodalField field, Eigen::Matrix3Xd &values) const override;
  void add_window_forces(const Eigen::Matrix3Xd &forces) override;

  void surface_points(const Eigen::Vector3d &lower, const Eigen::Vector3d &upper, const NearTest &near,
                      SurfacePoints &points) const override;
  void add_surface_forces(const Eigen::Matrix3Xd &forces, SurfaceLoad source) override;

  CellStress cell_stress() const override;
  std::vector<CellStiffness> cell_stiffness(const std::vector<int> &cells) const override;
  void set_state(const Eigen::Matrix3Xd &displacement, const Eigen::Matrix3Xd &velocity) override;
  Eigen::Matrix3Xd gather(NodalField field) const override;
  Energies energies() const override;
  double stable_step() const override;
  void check_motion() const override;
  void write_vtu(const std::string &path,
                 const std::vector<std::pair<std::string, Eigen::VectorXd>> &cell_fields) const override;

private:
  static constexpr int n = q1::n_nodes<dim>;

  const double *owned_values(NodalField field) const;
  void compute_cell_points();
  void build_kernel();
  void compute_masses();
  void stop_massless_nodes();
  void set_initial_state(const Eigen::Matrix3d &gradient);
  bool is_active(int owned_cell) const { return (alpha.template segment<n>(owned_cell * n).array() > 0.).any(); }
  std::array<double, n> weights_of(int owned_cell) const;
  template <typename Law>
  CellStress stress_of(const Law &law) const;
  double kinetic_energy_of_velocity_boundaries() const;
  void add_surface_work(double dt);
  double finite_step_energy() const;

  Settings settings;
  NodalSpace<dim> space;
  PointLocator<dim> locator;
  Eigen::Matrix3Xd points;

  /// Centres of as many owned cells as there are lanes.
  struct CentreBatch
  {
    Lanes gradient[n][dim]; ///< dN/dX [1/m]
    int dof[n][n_lanes];    ///< first one of each node
  };

  Eigen::VectorXd alpha;            ///< weight of every quadrature point of owned cells
  std::vector<CentreBatch> centres; ///< in the order of the owned cells; the last cell fills the rest of its batch
  CellKernel<dim> kernel;
  int n_active = 0;
  NodalVector displacement, velocity, force, mass;
  mutable NodalVector with_copies;  ///< displacements with copies and slaves up to date, for const functions
  std::vector<double> inverse_mass; ///< per owned component; 0 where prescribed or without mass
  double last_dt = 0.;              ///< of the last step [s]
  bool forces_are_current = false;  ///< false after set_state() and set_weights()

  std::vector<PrescribedDof> prescribed;
  Surface<dim> surface;
  AbsorbingBoundary<dim> absorbing;
  ExternalLoads<dim> loads;
  double now = 0.; ///< time of the positions [s]
  std::unique_ptr<NodalWindow<dim>> nodal_window;
  double boundary_work = 0.;                        ///< this rank's part [J]
  double absorbed_energy = 0.;                      ///< this rank's part [J]
  std::array<std::vector<double>, 2> surface_force; ///< of each SurfaceLoad in this step, on surface.owned_dofs() [N]
  std::array<double, 2> surface_work = {{0., 0.}};  ///< this rank's part [J]
};
} // namespace kerf::fem
