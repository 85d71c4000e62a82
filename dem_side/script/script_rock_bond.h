// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dem_side/engine/rock_bond_loop.h"

#include <memory>
#include <string>

namespace kerf::dem
{
/// The rock bond that a script names by `pair_style gran model kerf_rock_bond`: its parameters come from the line and its bonds
/// from a stored packing, see parse_rock_bond_line(). The fix rock_bond applies its local damping.
template <int dim>
class ScriptRockBond final : public RockBondLoop<dim>
{
public:
  using RockBondLoop<dim>::RockBondLoop;

  void settings(int n_words, char **words, LIGGGHTS::IContactHistorySetup *history) override;
  void init_granular() override;

private:
  using RockBondLoop<dim>::added;
  using RockBondLoop<dim>::bond_ends_made;
  using RockBondLoop<dim>::lmp;
  using RockBondLoop<dim>::parameters;

  struct Store
  {
    explicit Store(Packing all) : packing(std::move(all)), bonds(packing) {}
    const Packing packing;
    const StoredBonds bonds;
    double reach = 0.; // list_reach()
  };
  void read_store(const std::string &path);
  void check_created_bonds() const override;
  void check_step() const;
  void check_tags() const;
  LAMMPS_NS::FixPropertyAtom &tags() const; ///< of the particles at the last run
  bool damps_after_hook() const override { return false; }

  std::unique_ptr<Store> store;
};

/// Makes the model kerf_rock_bond known to LIGGGHTS. Can be called again.
void register_script_rock_bond();
} // namespace kerf::dem
