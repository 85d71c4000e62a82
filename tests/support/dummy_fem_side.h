// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fem_side/fem_side.h"

namespace kerf::test
{
/// Smallest possible finite-element side: a rectangle of bilinear cells that keeps displacements and collects forces. It shows
/// that the coupler needs nothing of the library behind the interface.
class DummyFemSide : public fem::FemSide
{
public:
  DummyFemSide(int n_x, int n_y, double h, double node_mass) : h(h), n_x(n_x)
  {
    geometry.nodes.resize(3, (n_x + 1) * (n_y + 1));
    for (int j = 0; j <= n_y; ++j)
      for (int i = 0; i <= n_x; ++i)
        geometry.nodes.col(j * (n_x + 1) + i) = Eigen::Vector3d(i * h, j * h, 0.);
    geometry.cells.resize(4, n_x * n_y);
    for (int j = 0; j < n_y; ++j)
      for (int i = 0; i < n_x; ++i)
      {
        const int corner = j * (n_x + 1) + i;
        geometry.cells.col(j * n_x + i) << corner, corner + 1, corner + n_x + 1, corner + n_x + 2;
      }
    geometry.owner.assign(geometry.n_cells(), 0);
    displacement = velocity = force = Eigen::Matrix3Xd::Zero(3, geometry.n_nodes());
    mass = Eigen::Matrix3Xd::Constant(3, geometry.n_nodes(), node_mass);
  }

  Eigen::Matrix3Xd displacement, velocity, force, mass;

  const fem::Mesh &mesh() const override { return geometry; }
  const Eigen::Matrix3Xd &quadrature_points() const override { return no_points; }
  const Eigen::Matrix3Xd &surface_positions() const override { return no_points; }
  const std::vector<int> &owned_cells() const override { return no_cells; }

  std::vector<fem::Interpolation> locate(const Eigen::Matrix3Xd &points) const override
  {
    std::vector<fem::Interpolation> found(points.cols());
    const int n_y = geometry.n_cells() / n_x;
    for (int k = 0; k < points.cols(); ++k)
    {
      const double x = points(0, k) / h, y = points(1, k) / h;
      const int i = std::min(static_cast<int>(x), n_x - 1), j = std::min(static_cast<int>(y), n_y - 1);
      if (x < 0. || y < 0. || x > n_x || y > n_y)
        continue;
      fem::Interpolation &row = found[k];
      row.cell = j * n_x + i;
      row.n = 4;
      row.xi = {{x - i, y - j, 0.}};
      for (int a = 0; a < 4; ++a)
      {
        const double s = a % 2 ? x - i : 1. - (x - i), t = a / 2 ? y - j : 1. - (y - j);
        row.nodes[a] = geometry.cells(a, row.cell);
        row.N[a] = s * t;
        row.dN.col(a) = Eigen::Vector3d((a % 2 ? 1. : -1.) * t / h, (a / 2 ? 1. : -1.) * s / h, 0.);
      }
    }
    return found;
  }

  void set_weights(const Eigen::VectorXd &, const Eigen::VectorXd &) override {}
  int n_active_cells() const override { return geometry.n_cells(); }
  void begin_step(double, double) override {}
  void compute_forces() override { force.setZero(); }
  void end_step(double, double) override {}
  void check_motion() const override {}

  void set_window(const std::vector<int> &nodes) override { window = nodes; }
  void read_window(fem::NodalField field, Eigen::Matrix3Xd &values) const override
  {
    const Eigen::Matrix3Xd &all = field == fem::NodalField::displacement ? displacement
                                  : field == fem::NodalField::velocity   ? velocity
                                  : field == fem::NodalField::mass       ? mass
                                                                         : force;
    values = all(Eigen::all, window);
  }
  void add_window_forces(const Eigen::Matrix3Xd &forces) override
  {
    for (std::size_t k = 0; k < window.size(); ++k)
      force.col(window[k]) += forces.col(static_cast<Eigen::Index>(k));
  }

  void surface_points(const Eigen::Vector3d &, const Eigen::Vector3d &, const fem::NearTest &,
                      fem::SurfacePoints &points) const override
  {
    points.position.resize(3, 0);
    points.velocity.resize(3, 0);
    points.area.resize(0);
  }
  void add_surface_forces(const Eigen::Matrix3Xd &, fem::SurfaceLoad) override {}
  fem::CellStress cell_stress() const override { return stress; }
  void set_state(const Eigen::Matrix3Xd &u, const Eigen::Matrix3Xd &v) override
  {
    displacement = u;
    velocity = v;
  }
  Eigen::Matrix3Xd gather(fem::NodalField field) const override
  {
    return field == fem::NodalField::displacement ? displacement : field == fem::NodalField::mass ? mass : velocity;
  }
  fem::Energies energies() const override { return {}; }
  std::vector<fem::CellStiffness> cell_stiffness(const std::vector<int> &) const override { return {}; }
  double stable_step() const override { return 1.; }
  void write_vtu(const std::string &, const std::vector<std::pair<std::string, Eigen::VectorXd>> &) const override {}

  fem::CellStress stress;

private:
  double h;
  int n_x;
  fem::Mesh geometry;
  Eigen::Matrix3Xd no_points{3, 0};
  std::vector<int> no_cells;
  std::vector<int> window;
};
} // namespace kerf::test
