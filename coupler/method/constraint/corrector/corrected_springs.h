// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "coupler/method/constraint/corrector/corrector.h"
#include "coupler/method/constraint/corrector/nodal_strain.h"

#include <vector>

namespace kerf
{
/// The springs of this rank to the places that particles fluctuate to, F C E from the smooth field (see Corrector), eight at a
/// time.
template <int dim>
class CorrectedSprings
{
public:
  /// @param stiffness of each entry [N/m]
  void renew(const CellBatches<dim> &cells, const ParticleInterpolation &interpolation, const Corrector &corrector,
             const dem::Particles &particles, const std::vector<double> &stiffness);
  /// After particles have got other places in the arrays.
  void renumber(const ParticleInterpolation &interpolation);

  /// f_i = -k_i chi_i on the particles, and on the nodes of the window what they do on their displacements. Returns the energy
  /// of the springs [J].
  /// @param period of the axes in which space repeats itself [m]
  double pull(const CellBatches<dim> &cells, const Eigen::Matrix3Xd &node_displacement, const Eigen::Vector3d &period,
              dem::Particles &particles, Eigen::Matrix3Xd &node_force);

private:
  static constexpr int corners = CellBatches<dim>::corners, n_strains = StrainComponents<dim>::n;
  /// Eight entries of one cell. Lanes that are left over repeat an entry without stiffness.
  struct Octet
  {
    std::array<SimdPack, dim> xi;
    SimdPack stiffness;                    ///< [N/m]
    std::ptrdiff_t begin[n_octet];         ///< of the particles' vectors, in the order of packs
    FloatPack fluctuation[dim][n_strains]; ///< C [m]
  };
  /// Coefficients of the fields in a cell.
  struct Field
  {
    typename PackedVectors<dim>::One place[corners];        ///< of the smooth field [m]
    typename StrainComponents<dim>::Vector strain[corners]; ///< E
    typename NodalStrain<dim>::Gradient turn;               ///< F
  };
  /// What an octet does.
  struct Pull
  {
    std::array<SimdPack, dim> force;       ///< on the particles [N]
    std::array<SimdPack, dim> fluctuation; ///< C E [m]
    SimdPack stress[n_strains];            ///< what the forces do on the strains [N m]
    SimdPack energy;                       ///< twice that of the springs [J]
  };
  /// Of the octets of a cell: moments with the monomials, and what is given to F.
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
  std::vector<std::array<int, n_octet>> link_of;
  std::vector<int> end; // of the octets of each cell
  std::vector<Pull> pulls;
  NodalStrain<dim> strains;
};
} // namespace kerf
