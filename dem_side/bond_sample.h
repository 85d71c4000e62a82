// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond_network.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

namespace kerf::dem
{
/// A rectangular sample of a 2D packing under three uniform strains (xx, yy, 2 xy): the static problem of its bond network.
/// Particles of the outer skin follow the strain without rotation, the others are free. Unknowns are the fluctuations about the
/// uniform strain, so that the weak diagonal that keeps loose parts solvable acts on nothing else, and a lattice, which has no
/// fluctuation, comes out exact.
class BondSample
{
public:
  explicit BondSample(const Packing &packing, int sample_size = 20000);

  /// Moduli with the free particles in equilibrium. The symbolic factorisation is kept between calls.
  Moduli relaxed(double k_n, double k_t);
  /// Moduli with all particles following the strain.
  Moduli affine(double k_n, double k_t) const;

private:
  struct Bond
  {
    int i, j;                          ///< particles of the sample
    Eigen::Vector2d normal, branch;    ///< unit vector and vector from i to j
    double lever_i, lever_j;           ///< contact point from the centres [m]
    double weight;                     ///< mean of the window function along the branch
    Eigen::RowVector3d stretch, shear; ///< relative displacement in the three uniform strains [m]
  };
  using Fluctuation = Eigen::Matrix<double, 3, 3>; ///< (u_x, u_y, rotation * mean radius) x strain case

  void choose_window(const Packing &packing, int sample_size);
  void collect(const Packing &packing);
  void assemble();
  double window(const Eigen::Vector2d &x) const;
  Moduli moduli(double k_n, double k_t, const std::vector<Fluctuation> &fluctuation) const;

  double m_mean_diameter = 0.;
  Eigen::Vector2d m_lower, m_upper;               ///< of the sample
  Eigen::Vector2d m_window_lower, m_window_upper; ///< support of the window function
  Eigen::Vector2d m_taper;
  std::vector<Eigen::Vector2d> m_centres;
  std::vector<int> m_first_unknown; ///< of each particle, -1 in the skin
  std::vector<Bond> m_bonds;
  int m_unknowns = 0;
  Eigen::SparseMatrix<double> m_normal, m_tangential; ///< stiffness for k_n = 1 and k_t = 1, lower triangle, same pattern
  Eigen::MatrixX3d m_normal_load, m_tangential_load;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> m_solver;
  bool m_analysed = false;
};
} // namespace kerf::dem
