// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/rock_bond_law.h"
#include "dem_side/rock_bond_style.h"

#include <neigh_list.h>

namespace kerf::dem
{
/// Rotation of a particle, ready to turn vectors.
template <int dim>
struct Turn;

template <>
struct Turn<2>
{
  Eigen::Vector2d cos_sin;
  void set(const double *q) { cos_sin = {q[0] * q[0] - q[3] * q[3], 2. * q[0] * q[3]}; }
  Eigen::Vector2d operator*(const Eigen::Vector2d &a) const { return cos_sin.x() * a + cos_sin.y() * law::quarter_turn(a); }
};

template <>
struct Turn<3>
{
  Eigen::Matrix3d matrix;
  void set(const double *q) { matrix = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).toRotationMatrix(); }
  Eigen::Vector3d operator*(const Eigen::Vector3d &a) const { return matrix * a; }
};

/// All that the pair loop needs of one particle side by side (two cache lines in 2D, one if there is no damping):
/// LIGGGHTS' separate arrays would cost a cache miss each.
template <int dim>
struct alignas(64) ParticleRow
{
  law::Vector<dim> position, force;
  Turn<dim> turn;
  double radius, weight;
  law::Spin<dim> torque, spin;
  double mass;
  law::Spin<dim> damping_torque;
  law::Vector<dim> velocity, damping_force;
};

/// The pair loop of the rock bond.
template <int dim>
class RockBondLoop final : public RockBondStyle
{
public:
  RockBondLoop(LAMMPS_NS::LAMMPS &lmp, LAMMPS_NS::PairGran &gran, std::int64_t hash, const RockBondParameters &parameters)
    : RockBondStyle(lmp, gran, hash, parameters)
  {
  }
  std::vector<ActiveBond> bonds() override;
  double elastic_energy() override;

private:
  using Vector = law::Vector<dim>;
  using Row = ParticleRow<dim>;

  /// A pair in a fixed order, so that both ranks of a pair across ranks compute the same bits.
  struct OrderedPair
  {
    Row &first, &second;
    double sign;  ///< of the history's vector
    double share; ///< of this rank in energies
    double weight;
  };

  void pair_forces(bool step) override;
  void damp(bool step) override;
  void load_rows(bool step);
  void store_forces();
  template <bool damped>
  void visit_pairs(bool step);
  template <bool damped>
  double contact(const OrderedPair &pair, PairHistory &history, int &flag, bool step, bool just_broken);
  template <bool damped>
  void break_bond(const OrderedPair &pair, const law::BondStrain<dim> &strain, PairHistory &history, int &flag);
  OrderedPair ordered(int i, int j);

  std::vector<Row> rows; ///< local and ghost particles at the last force computation
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
