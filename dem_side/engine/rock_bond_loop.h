// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/intact_bonds.h"
#include "dem_side/engine/rock_bond_style.h"

#include <array>
#include <neigh_list.h>

namespace kerf::dem
{
/// On one particle.
template <int dim>
struct Load
{
  law::Vector<dim> force;
  law::Spin<dim> torque;
};

/// The pair loop of the rock bond. Intact bonds and other pairs of LIGGGHTS' lists go through loops of their own; what a step
/// needs of both is collected when LIGGGHTS builds its lists. LIGGGHTS' contact history is written when a bond breaks and by
/// contacts, so that particles that change rank take the present state along.
template <int dim>
class RockBondLoop final : public RockBondStyle
{
public:
  RockBondLoop(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash, const RockBondParameters &parameters)
    : RockBondStyle(lmp, gran, hash, parameters)
  {
  }
  std::vector<ActiveBond> bonds(const std::vector<char> &target) override;
  double elastic_energy() override;

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
  /// A near pair without an intact bond.
  struct DebrisPair
  {
    OrderedPair pair;
    double length;    ///< distance at which the contact begins [m]
    double viscosity; ///< normal [N s/m]
    PairHistory *history;
    int *flag; ///< of LIGGGHTS: whether the history is worth keeping
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
  ContactSprings contact(const DebrisPair &loose, bool step, bool just_broken);
  template <bool damped>
  void break_bond(const typename IntactBonds<dim>::Failing &bond);
  OrderedPair ordered(int i, int j) const;
  DebrisPair loose(const OrderedPair &pair, PairHistory &history, int &flag) const;
  law::Pair<dim> geometry(const OrderedPair &pair) const;
  law::Pair<dim> bond_geometry(const OrderedPair &pair) const; ///< with the branches of a weighted bond
  /// The reference normal of a bond, turned with either particle.
  std::array<Vector, 2> turned_normals(const OrderedPair &pair, const PairHistory &history) const;
  law::BondStrain<dim> bond_strain(const OrderedPair &pair, const PairHistory &history) const;
  /// Of an intact bond, weighted [J].
  double bond_energy(const OrderedPair &pair, const law::BondStrain<dim> &strain, const PairHistory &history) const;
  /// Of the springs of an intact bond on its particles at the velocities of the step, weighted [W].
  double bond_power(const OrderedPair &pair, const law::BondStrain<dim> &strain, const PairHistory &history) const;
  double viscosity(const OrderedPair &pair) const;

  std::vector<Row> rows;          ///< local and ghost particles at the last force computation
  std::vector<Load<dim>> viscous; ///< part of the loads on local particles
  IntactBonds<dim> intact;
  std::vector<typename IntactBonds<dim>::Bond> listed; ///< what they were assigned, kept for its memory
  std::vector<DebrisPair> debris_pairs;
  // Most loose pairs are apart. They are looked at again when a particle has moved by half the gap that near ones are within.
  std::vector<int> near_pairs;
  std::vector<Vector> looked_from; ///< positions of the rows when near pairs were found
  double moved = 0.;               ///< largest distance from there, squared [m^2]
};

template <typename Visit>
void RockBondStyle::for_each_pair(const Visit &visit) const
{
  const LAMMPS_NS::NeighList &list = *gran.list;
  for (int k = 0; k < list.inum; ++k)
  {
    const int i = list.ilist[k];
    const int n_pairs = list.numneigh[i];
    const int *others = list.firstneigh[i];
    int *flags = gran.listgranhistory->firstneigh[i];
    auto *histories = reinterpret_cast<PairHistory *>(gran.listgranhistory->firstdouble[i]);
    for (int n = 0; n < n_pairs; ++n)
      visit(i, others[n] & NEIGHMASK, histories[n], flags[n]);
  }
}
} // namespace kerf::dem
