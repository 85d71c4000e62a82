// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/intact_bonds.h"
#include "dem_side/engine/local_damping.h"
#include "dem_side/engine/rock_bond_style.h"

#include <array>
#include <vector>

namespace kerf::dem
{
/// The pair loop of the rock bond. Intact bonds and the other pairs of LIGGGHTS' lists have loops of their own, over data that
/// are collected when LIGGGHTS builds its lists. Breaking bonds and contacts also write LIGGGHTS' contact history, so that
/// particles that change rank carry the present state with them.
template <int dim>
class RockBondLoop : public RockBondStyle
{
public:
  RockBondLoop(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash) : RockBondStyle(lmp, gran, hash) {}
  std::vector<ActiveBond> bonds(const std::vector<char> &target) override;
  double elastic_energy() override;
  std::vector<LoadedPair> loaded_pairs() override;
  void prepare_weights(const Eigen::VectorXd &new_weights, const std::vector<char> &leaves) override;

private:
  using Vector = law::Vector<dim>;
  using Row = ParticleRow<dim>;

  /// A pair in an order that both ranks of a pair across ranks agree on, so that they compute the same bits.
  struct OrderedPair
  {
    int first, second;
    double sign;            ///< of the history's vector
    double share;           ///< of this rank in energies
    double weight, rolling; ///< see bond_weight.h
  };
  /// A pair of the lists without an intact bond.
  struct DebrisPair
  {
    OrderedPair pair;
    double length;    ///< distance at which the contact begins [m]
    double viscosity; ///< normal [N s/m]
    PairHistory *history;
    int *flag; ///< of LIGGGHTS: whether it must keep the history
  };

  void pair_forces(bool step) override;
  void damp(bool step) override;
  void load_constants();
  void collect_pairs();
  void load_rows(bool step);
  void find_near_pairs();
  void store_forces();
  template <bool damped>
  void add_pair_loads(bool step);
  /// Elastic energy of a contact [J] and power of its springs on the particles [W], both weighted.
  struct ContactSprings
  {
    double energy = 0., power = 0.;
  };
  template <bool damped>
  ContactSprings contact(const DebrisPair &debris, bool step, bool just_broken);
  template <bool damped>
  void break_bond(const typename IntactBonds<dim>::Failing &bond);
  OrderedPair ordered(int i, int j) const;
  DebrisPair debris_pair(const OrderedPair &pair, PairHistory &history, int &flag) const;
  law::Pair<dim> geometry(const OrderedPair &pair) const;
  law::Pair<dim> bond_geometry(const OrderedPair &pair) const; ///< with the branches of a weighted bond
  /// The reference normal of a bond, rotated with either particle.
  std::array<Vector, 2> rotated_normals(const OrderedPair &pair, const PairHistory &history) const;
  law::BondStrain<dim> bond_strain(const OrderedPair &pair, const PairHistory &history) const;
  /// Energy of an intact bond, weighted [J].
  double bond_energy(const OrderedPair &pair, const law::BondStrain<dim> &strain, const PairHistory &history) const;
  /// Power of the springs of an intact bond on its particles at the velocities of the step, weighted [W].
  double bond_power(const OrderedPair &pair, const law::BondStrain<dim> &strain, const PairHistory &history) const;
  double viscosity(const OrderedPair &pair) const;
  /// Force of a pair on its first particle and its energy, as in the last force computation; nothing changes.
  Vector present_force(const OrderedPair &pair, const PairHistory &history, double length, double &energy) const;

  std::vector<Row> rows;          ///< local and ghost particles at the last force computation
  std::vector<Load<dim>> viscous; ///< viscous part of the loads on local particles
  IntactBonds<dim> intact;
  std::vector<typename IntactBonds<dim>::Bond> listed; ///< input of IntactBonds::assign(), kept to reuse its memory
  std::vector<DebrisPair> debris_pairs;
  // Most debris pairs have a gap. They are searched again for near pairs when a particle has moved by half of the largest gap
  // of a near pair.
  std::vector<int> near_pairs;
  std::vector<Vector> searched_at; ///< positions of the rows at the last search
  double largest_square_move = 0.; ///< largest distance from there, squared [m^2]
};
} // namespace kerf::dem
