// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/bond_network/bond_network.h"

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
  /// Moduli with the free particles in equilibrium. What can be kept between calls (symbolic factorisation, last solution) is.
  virtual Moduli relaxed(double k_n, double k_t) = 0;
  /// Moduli with all particles following the strain.
  virtual Moduli affine(double k_n, double k_t) const = 0;
};
std::unique_ptr<BondSample> make_bond_sample(const Packing &packing, int sample_size = 20000);

/// Particles of the outer skin follow the strain without rotation, the others are free; a periodic packing has no skin at the
/// sides that repeat. Unknowns are the fluctuations about the
/// uniform strain, so that the weak diagonal that keeps loose parts solvable acts on nothing else. The stress of a particle
/// comes with the volume of its Laguerre cell, both weighted by a window function. So a lattice, which has no fluctuation and
/// equal cells, comes out exact.
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
  std::array<bool, 3> m_periodic = {{false, false, false}}; ///< the sample is as long as the packing and has no skin there
  Vector m_lower, m_upper;                                  ///< of the sample
  Vector m_window_lower, m_window_upper;                    ///< support of the window function
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
