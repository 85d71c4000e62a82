// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond_network/moduli.h"
#include "dem_side/packing/packing.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <memory>

namespace kerf::dem
{
/// A rectangular sample of a packing under uniform strains: the static problem of its bond network.
class BondSample
{
public:
  virtual ~BondSample() = default;
  /// Moduli with the free particles in equilibrium [Pa]. Keeps the symbolic factorisation and the last solution between calls.
  /// @p k_n, @p k_t stiffnesses of a bond [N/m] (2D: per metre)
  virtual Moduli relaxed(double k_n, double k_t) = 0;
  /// Moduli with all particles following the strain [Pa].
  virtual Moduli affine(double k_n, double k_t) const = 0;
};
std::unique_ptr<BondSample> make_bond_sample(const Packing &packing, int sample_size = 20000);

/// Particles of the outer skin follow the strain without rotation, the others are free. There is no skin at periodic sides. The
/// unknowns are the fluctuations about the uniform strain, so the weak diagonal that keeps unconnected parts solvable acts on
/// fluctuations only. The mean stress is the sum of the particles' virials over the sum of their Laguerre cells, both weighted
/// by a window function. The result is therefore exact for a lattice, which has no fluctuations and equal cells.
/// Theory (11.7), (11.8).
template <int dim>
class BondSampleOf : public BondSample
{
public:
  BondSampleOf(const Packing &packing, int sample_size);

  Moduli relaxed(double k_n, double k_t) override;
  Moduli affine(double k_n, double k_t) const override;

private:
  static constexpr int n_strains = dim * (dim + 1) / 2;
  static constexpr int dofs = dim == 2 ? 3 : 6;
  using Vector = Eigen::Matrix<double, dim, 1>;
  using Tensor = Eigen::Matrix<double, dim, dim>;
  using Components = Eigen::Matrix<double, n_strains, 1>;
  /// Row: (translation, rotation * mean radius), column: strain case.
  using Fluctuation = Eigen::Matrix<double, dofs, n_strains>;
  using Kinematics = Eigen::Matrix<double, dim, 2 * dofs>;
  using Jump = Eigen::Matrix<double, dim, n_strains>; ///< relative displacement at the contact in all strain cases [m]
  using Columns = Eigen::Matrix<double, Eigen::Dynamic, n_strains>;

  struct Bond
  {
    int i, j;                ///< particles of the sample
    Vector normal;           ///< unit vector from i to j
    double lever_i, lever_j; ///< contact point from the centres [m]
  };

  static const std::array<Tensor, n_strains> &strain_cases();
  static Components components(const Tensor &tensor);
  void choose_window(const Packing &packing, int sample_size);
  void collect(const Packing &packing);
  void assemble();
  Kinematics kinematics(const Bond &bond) const;
  Jump uniform_jump(const Bond &bond) const;
  double window(const Vector &x) const;
  Columns solve(double ratio);
  Moduli moduli(double k_n, double k_t, const std::vector<Fluctuation> &fluctuation) const;

  double m_mean_diameter = 0.;
  std::array<bool, 3> m_periodic = {{false, false, false}}; ///< axes without skin, along which the sample is the whole packing
  Vector m_lower, m_upper;                                  ///< of the sample [m]
  Vector m_window_lower, m_window_upper;                    ///< support of the window function [m]
  Vector m_taper;
  std::vector<Vector> m_centres;
  std::vector<double> m_weights, m_volumes; ///< of each particle: of the window function; of its cell
  std::vector<int> m_first_unknown;         ///< of each particle, -1 in the skin
  std::vector<Bond> m_bonds;
  int m_unknowns = 0;
  Eigen::SparseMatrix<double> m_normal, m_tangential; ///< stiffness for k_n = 1 and k_t = 1, lower triangle, same pattern
  Columns m_normal_load, m_tangential_load;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> m_cholesky;
  Columns m_last_solution;
};
} // namespace kerf::dem
