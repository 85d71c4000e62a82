// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/corrector.h"
#include "coupler/method/constraint/corrector/nodal_strain.h"

#include <vector>

namespace kerf
{
/// The springs of this rank between particles and their corrected positions, which differ from the smooth field by F C E (see
/// Corrector). Eight springs are evaluated at a time. Theory (6.7), (6.8).
template <int dim>
class CorrectedSprings
{
public:
  /// @param stiffness of each entry [N/m]
  void renew(const CellBatches<dim> &cells, const ParticleInterpolation &interpolation, const Corrector &corrector,
             const dem::Particles &particles, const std::vector<double> &stiffness);
  /// Called after the particles have moved in their arrays.
  void renumber(const ParticleInterpolation &interpolation);

  /// Adds f_i = -k_i chi_i to the particles and the conjugate forces to the nodes of the nodal window. Returns the energy of
  /// the springs [J]. @param period of the periodic axes, 0 in others [m]
  double pull(const CellBatches<dim> &cells, const Eigen::Matrix3Xd &node_displacement, const Eigen::Vector3d &period,
              dem::Particles &particles, Eigen::Matrix3Xd &node_force);

private:
  static constexpr int corners = CellBatches<dim>::corners, n_strains = StrainComponents<dim>::n;
  /// Eight tied particles of one cell. Unused lanes repeat a particle with zero stiffness.
  struct Octet
  {
    std::array<SimdPack, dim> xi;
    SimdPack stiffness;                    ///< [N/m]
    std::ptrdiff_t begin[n_octet];         ///< positions of the particles' vectors in an array, in the order of packs
    FloatPack fluctuation[dim][n_strains]; ///< C [m]
  };
  /// Coefficients of the fields in a cell, for the monomials of value_of().
  struct Field
  {
    typename PackedVectors<dim>::One place[corners];        ///< position by the smooth field [m]
    typename StrainComponents<dim>::Vector strain[corners]; ///< E
    typename NodalStrain<dim>::Gradient turn;               ///< F
  };
  /// Forces and energy of an octet.
  struct Pull
  {
    std::array<SimdPack, dim> force;       ///< on the particles [N]
    std::array<SimdPack, dim> fluctuation; ///< C E [m]
    SimdPack stress[n_strains];            ///< conjugate to the strains E [N m]
    SimdPack energy;                       ///< twice the energy of the springs [J]
  };
  /// Sums over the octets of a cell: moments of the forces with the monomials, and the values conjugate to F.
  struct Sums
  {
    SimdPack force[dim][corners], stress[n_strains][corners], turn[dim][dim];

    void add_force(const Octet &octet, const Pull &pull, int component);
    void add_stress(const Octet &octet, const Pull &pull, int strain);
  };
  template <bool periodic>
  double pull(const CellBatches<dim> &cells, const Eigen::Matrix3Xd &node_displacement, const Eigen::Vector3d &period,
              dem::Particles &particles, Eigen::Matrix3Xd &node_force);
  void fetch_after(int octet, const dem::Particles &particles) const;
  template <bool periodic>
  Pull pull_octet(const Octet &octet, const Field &field, const Eigen::Vector3d &period, dem::Particles &particles);
  void give(const CellBatches<dim> &cells, std::size_t cell, const Sums &sums, Eigen::Matrix3Xd &node_force);

  std::vector<Octet> octets;
  std::vector<std::array<int, n_octet>> entry_of;
  std::vector<int> end; // end of the octets of each cell
  std::vector<Pull> pulls;
  NodalStrain<dim> strains;
};
} // namespace kerf
